var _M=Object.create;var Tu=Object.defineProperty;var vM=Object.getOwnPropertyDescriptor;var yM=Object.getOwnPropertyNames;var xM=Object.getPrototypeOf,bM=Object.prototype.hasOwnProperty;var op=(n,e,t)=>()=>{if(t)throw t[0];try{return n&&(e=n(n=0)),e}catch(i){throw t=[i],i}};var zt=(n,e)=>()=>{try{return e||n((e={exports:{}}).exports,e),e.exports}catch(t){throw e=0,t}},ap=(n,e)=>{for(var t in e)Tu(n,t,{get:e[t],enumerable:!0})},A0=(n,e,t,i)=>{if(e&&typeof e=="object"||typeof e=="function")for(let s of yM(e))!bM.call(n,s)&&s!==t&&Tu(n,s,{get:()=>e[s],enumerable:!(i=vM(e,s))||i.enumerable});return n};var SM=(n,e,t)=>(t=n!=null?_M(xM(n)):{},A0(e||!n||!n.__esModule?Tu(t,"default",{value:n,enumerable:!0}):t,n)),lp=n=>A0(Tu({},"__esModule",{value:!0}),n);var Gy=zt($y=>{"use strict";Object.defineProperty($y,"__esModule",{value:!0})});var Wy=zt(af=>{"use strict";Object.defineProperty(af,"__esModule",{value:!0});af.Hierarchy=void 0;af.Hierarchy={parse:FC};function FC(n){return Object.entries(n).reduce((e,[t,i])=>(i===-1?e.pages[t]={}:i&&(e.nodes[t]={pointCount:i}),e),{nodes:{},pages:{}})}});var qy=zt(po=>{"use strict";var BC=po&&po.__createBinding||(Object.create?(function(n,e,t,i){i===void 0&&(i=t);var s=Object.getOwnPropertyDescriptor(e,t);(!s||("get"in s?!e.__esModule:s.writable||s.configurable))&&(s={enumerable:!0,get:function(){return e[t]}}),Object.defineProperty(n,i,s)}):(function(n,e,t,i){i===void 0&&(i=t),n[i]=e[t]})),Xy=po&&po.__exportStar||function(n,e){for(var t in n)t!=="default"&&!Object.prototype.hasOwnProperty.call(e,t)&&BC(e,n,t)};Object.defineProperty(po,"__esModule",{value:!0});Xy(Gy(),po);Xy(Wy(),po)});var lf=zt(bl=>{"use strict";Object.defineProperty(bl,"__esModule",{value:!0});bl.hierarchyItemLength=bl.infoLength=void 0;bl.infoLength=160;bl.hierarchyItemLength=32});var cf=zt(mo=>{"use strict";Object.defineProperty(mo,"__esModule",{value:!0});mo.evlrHeaderLength=mo.vlrHeaderLength=mo.minHeaderLength=void 0;mo.minHeaderLength=375;mo.vlrHeaderLength=54;mo.evlrHeaderLength=60});var Yy=zt(Sl=>{"use strict";Object.defineProperty(Sl,"__esModule",{value:!0});Sl.getBigUint64=Sl.parseBigInt=void 0;function kC(n){if(n>BigInt(Number.MAX_SAFE_INTEGER)||n<BigInt(-Number.MAX_SAFE_INTEGER))throw new Error(`Cannot convert bigint to number: ${n}`);return Number(n)}Sl.parseBigInt=kC;function zC(n,e,t){if(n.getBigUint64)return n.getBigUint64(e,t);let[i,s]=t?[4,0]:[0,4],r=BigInt(n.getUint32(e+i,t)),o=BigInt(n.getUint32(e+s,t));return(r<<BigInt(32))+o}Sl.getBigUint64=zC});var Zy=zt(go=>{"use strict";Object.defineProperty(go,"__esModule",{value:!0});go.toCString=go.toDataView=go.Binary=void 0;go.Binary={toDataView:rg,toCString:jy};function rg(n){return new DataView(n.buffer,n.byteOffset,n.length)}go.toDataView=rg;function jy(n){let e=rg(n),t="";for(let i=0;i<e.byteLength;++i){let s=e.getInt8(i);if(s===0)return t;t+=String.fromCharCode(s)}return t}go.toCString=jy});var tx=zt(uf=>{"use strict";Object.defineProperty(uf,"__esModule",{value:!0});uf.Bounds=void 0;uf.Bounds={min:VC,max:HC,mid:og,width:Jy,depth:Ky,height:Qy,cube:$C,step:ex,stepTo:GC,intersection:WC};function VC(n){return[n[0],n[1],n[2]]}function HC(n){return[n[3],n[4],n[5]]}function og([n,e,t,i,s,r]){return[n+(i-n)/2,e+(s-e)/2,t+(r-t)/2]}function Jy(n){return n[3]-n[0]}function Ky(n){return n[4]-n[1]}function Qy(n){return n[5]-n[2]}function $C(n){let e=og(n),t=Math.max(Jy(n),Ky(n),Qy(n))/2;return[e[0]-t,e[1]-t,e[2]-t,e[0]+t,e[1]+t,e[2]+t]}function ex(n,[e,t,i]){let[s,r,o,a,l,c]=n,[u,h,d]=og(n);return[e?u:s,t?h:r,i?d:o,e?a:u,t?l:h,i?c:d]}function GC(n,[e,t,i,s]){for(let r=e-1;r>=0;--r)n=ex(n,[t>>r&1,i>>r&1,s>>r&1]);return n}function WC(n,e){return[Math.max(n[0],e[0]),Math.max(n[1],e[1]),Math.max(n[2],e[2]),Math.min(n[3],e[3]),Math.min(n[4],e[4]),Math.min(n[5],e[5])]}});var nx=zt(hf=>{"use strict";Object.defineProperty(hf,"__esModule",{value:!0});hf.Dimension=void 0;var XC={int8:{type:"signed",size:1},int16:{type:"signed",size:2},int32:{type:"signed",size:4},int64:{type:"signed",size:8},uint8:{type:"unsigned",size:1},uint16:{type:"unsigned",size:2},uint32:{type:"unsigned",size:4},uint64:{type:"unsigned",size:8},float32:{type:"float",size:4},float64:{type:"float",size:8},float:{type:"float",size:4},double:{type:"float",size:8},bool:{type:"unsigned",size:1},boolean:{type:"unsigned",size:1}};hf.Dimension={Type:XC,ctype:qC};function qC({type:n,size:e}){switch(n){case"signed":switch(e){case 1:return"int8";case 2:return"int16";case 4:return"int32";case 8:return"int64"}case"unsigned":switch(e){case 1:return"uint8";case 2:return"uint16";case 4:return"uint32";case 8:return"uint64"}case"float":switch(e){case 4:return"float";case 8:return"double"}}throw new Error(`Invalid dimension type/size: ${n}/${e}`)}});var ix={};ap(ix,{createLazPerf:()=>jC,default:()=>YC});var YC,jC,sx=op(()=>{YC=void 0,jC=void 0});var rx={};ap(rx,{createLazPerf:()=>JC,default:()=>ZC});var ZC,JC,ox=op(()=>{ZC=void 0,JC=void 0});var cx=zt(us=>{"use strict";var KC=us&&us.__createBinding||(Object.create?(function(n,e,t,i){i===void 0&&(i=t);var s=Object.getOwnPropertyDescriptor(e,t);(!s||("get"in s?!e.__esModule:s.writable||s.configurable))&&(s={enumerable:!0,get:function(){return e[t]}}),Object.defineProperty(n,i,s)}):(function(n,e,t,i){i===void 0&&(i=t),n[i]=e[t]})),QC=us&&us.__setModuleDefault||(Object.create?(function(n,e){Object.defineProperty(n,"default",{enumerable:!0,value:e})}):function(n,e){n.default=e}),eR=us&&us.__importStar||function(n){if(n&&n.__esModule)return n;var e={};if(n!=null)for(var t in n)t!=="default"&&Object.prototype.hasOwnProperty.call(n,t)&&KC(e,n,t);return QC(e,n),e},tR=us&&us.__importDefault||function(n){return n&&n.__esModule?n:{default:n}};Object.defineProperty(us,"__esModule",{value:!0});us.Getter=void 0;var nR=tR((sx(),lp(ix)));us.Getter={create:iR,http:ax,file:lx};function iR(n){return typeof n=="function"?n:n.startsWith("http://")||n.startsWith("https://")?ax(n):lx(n)}function ax(n){return async function(t,i){if(t<0||i<0||t>i)throw new Error("Invalid range");let r=await(await(0,nR.default)(n,{headers:{Range:`bytes=${t}-${i-1}`}})).arrayBuffer();return new Uint8Array(r)}}function lx(n){return async function(t,i){let s=await Promise.resolve().then(()=>eR((ox(),lp(rx))));async function r(o=0,a=1/0){if(o<0||a<0||o>a)throw new Error("Invalid range");await s.promises.access(n);let l=s.createReadStream(n,{start:o,end:a-1,autoClose:!0});return sR(l)}return r(t,i)}}async function sR(n){return await new Promise((e,t)=>{let i=[];n.on("data",s=>i.push(s)),n.on("error",t),n.on("end",()=>e(Buffer.concat(i)))})}});var hx=zt(Ml=>{"use strict";Object.defineProperty(Ml,"__esModule",{value:!0});Ml.Key=void 0;Ml.Key={create:rR,parse:ux,toString:oR,step:aR,up:lR,compare:cR,depth:uR};function rR(n,e=0,t=0,i=0){return typeof n!="number"?ux(n):[n,e,t,i]}function ux(n){if(typeof n!="string")return n;let[e,t,i,s,...r]=n.split("-").map(a=>parseInt(a,10)),o=[e,t,i,s];if(r.length!==0||o.some(a=>typeof a!="number"||Number.isNaN(a)))throw new Error(`Invalid key: ${n}`);return o}function oR(n){return typeof n=="string"?n:n.join("-")}function aR(n,[e,t,i]){let[s,r,o,a]=Ml.Key.create(n);return[s+1,r*2+e,o*2+t,a*2+i]}function lR(n,e=1){let[t,i,s,r]=Ml.Key.create(n);return[t-e,i>>e,s>>e,r>>e]}function cR(n,e){for(let t=0;t<n.length;++t){if(n[t]<e[t])return-1;if(n[t]>e[t])return 1}return 0}function uR(n){return n[0]}});var dx=zt(df=>{"use strict";Object.defineProperty(df,"__esModule",{value:!0});df.Scale=void 0;df.Scale={apply:(n,e=1,t=0)=>(n-t)/e,unapply:(n,e=1,t=0)=>n*e+t}});var fx=zt(ff=>{"use strict";Object.defineProperty(ff,"__esModule",{value:!0});ff.Step=void 0;ff.Step={fromIndex:hR,list:dR};function hR(n){if(n<0||n>=8)throw new Error(`Invalid step index: ${n}`);let e=n>>0&1?1:0,t=n>>1&1?1:0,i=n>>2&1?1:0;return[e,t,i]}function dR(){return[[0,0,0],[0,0,1],[0,1,0],[0,1,1],[1,0,0],[1,0,1],[1,1,0],[1,1,1]]}});var hs=zt(xn=>{"use strict";var fR=xn&&xn.__createBinding||(Object.create?(function(n,e,t,i){i===void 0&&(i=t);var s=Object.getOwnPropertyDescriptor(e,t);(!s||("get"in s?!e.__esModule:s.writable||s.configurable))&&(s={enumerable:!0,get:function(){return e[t]}}),Object.defineProperty(n,i,s)}):(function(n,e,t,i){i===void 0&&(i=t),n[i]=e[t]})),pR=xn&&xn.__exportStar||function(n,e){for(var t in n)t!=="default"&&!Object.prototype.hasOwnProperty.call(e,t)&&fR(e,n,t)};Object.defineProperty(xn,"__esModule",{value:!0});xn.Step=xn.Scale=xn.Key=xn.Getter=xn.Dimension=xn.Bounds=xn.Binary=void 0;pR(Yy(),xn);var mR=Zy();Object.defineProperty(xn,"Binary",{enumerable:!0,get:function(){return mR.Binary}});var gR=tx();Object.defineProperty(xn,"Bounds",{enumerable:!0,get:function(){return gR.Bounds}});var _R=nx();Object.defineProperty(xn,"Dimension",{enumerable:!0,get:function(){return _R.Dimension}});var vR=cx();Object.defineProperty(xn,"Getter",{enumerable:!0,get:function(){return vR.Getter}});var yR=hx();Object.defineProperty(xn,"Key",{enumerable:!0,get:function(){return yR.Key}});var xR=dx();Object.defineProperty(xn,"Scale",{enumerable:!0,get:function(){return xR.Scale}});var bR=fx();Object.defineProperty(xn,"Step",{enumerable:!0,get:function(){return bR.Step}})});var ag=zt(mf=>{"use strict";Object.defineProperty(mf,"__esModule",{value:!0});mf.ExtraBytes=void 0;var mi=hs();mf.ExtraBytes={getDimension:SR,parse:MR,parseOne:px};var pf=192;function SR({type:n,length:e}){switch(n){case"signed":case"unsigned":switch(e){case 1:case 2:case 4:case 8:return{type:n,size:e}}case"float":switch(e){case 4:case 8:return{type:n,size:e}}}}function MR(n){if(n.byteLength%pf!==0)throw new Error(`Invalid extra bytes VLR length: ${n.byteLength}`);let e=[];for(let t=0;t<n.byteLength;t+=pf)e.push(px(n.slice(t,t+pf)));return e}function px(n){if(n.byteLength!==pf)throw new Error(`Invalid extra bytes entry length: ${n.byteLength}`);let e=mi.Binary.toDataView(n),t=mi.Binary.toCString(n.slice(4,36)),i=mi.Binary.toCString(n.slice(60,192)),s=e.getUint8(2),r=e.getUint8(3);if(s>=11)throw new Error(`Invalid extra bytes "type" value: ${s}`);if(s===0)return{name:t,description:i,length:r};let o=ER(r),a=wR(s);if(!a)throw new Error(`Failed to extract dimension type: ${s}`);let{type:l,size:c}=a;function u(d){switch(l){case"signed":return(0,mi.parseBigInt)(e.getBigInt64(d,!0));case"unsigned":return(0,mi.parseBigInt)((0,mi.getBigUint64)(e,d,!0));case"float":return e.getFloat64(d,!0)}}let h={name:t,description:i,type:l,length:c};return o.hasNodata&&(h.nodata=u(40)),o.hasMin&&(h.min=u(64)),o.hasMax&&(h.max=u(88)),o.hasScale&&(h.scale=e.getFloat64(112)),o.hasOffset&&(h.offset=e.getFloat64(136)),h}function wR(n){switch(n){case 1:return mi.Dimension.Type.uint8;case 2:return mi.Dimension.Type.int8;case 3:return mi.Dimension.Type.uint16;case 4:return mi.Dimension.Type.int16;case 5:return mi.Dimension.Type.uint32;case 6:return mi.Dimension.Type.int32;case 7:return mi.Dimension.Type.uint64;case 8:return mi.Dimension.Type.int64;case 9:return mi.Dimension.Type.float32;case 10:return mi.Dimension.Type.float64}}function ER(n){return{hasNodata:!!(n&1),hasMin:!!(n>>1&1),hasMax:!!(n>>2&1),hasScale:!!(n>>3&1),hasOffset:!!(n>>4&1)}}});var lg=zt(gf=>{"use strict";Object.defineProperty(gf,"__esModule",{value:!0});gf.Dimensions=void 0;var TR=hs(),AR=ag();gf.Dimensions={create:RR};var{Type:mn}=TR.Dimension,CR={X:mn.float64,Y:mn.float64,Z:mn.float64,Intensity:mn.uint16,ReturnNumber:mn.uint8,NumberOfReturns:mn.uint8,ScanDirectionFlag:mn.boolean,EdgeOfFlightLine:mn.boolean,Classification:mn.uint8,Synthetic:mn.boolean,KeyPoint:mn.boolean,Withheld:mn.boolean,Overlap:mn.boolean,ScanAngle:mn.float32,UserData:mn.uint8,PointSourceId:mn.uint16,GpsTime:mn.float64,Red:mn.uint16,Green:mn.uint16,Blue:mn.uint16,ScannerChannel:mn.uint8,Infrared:mn.uint16};function RR(n,e=[]){return Object.keys(n).reduce((t,i)=>{let s=CR[i];if(s)return{...t,[i]:s};let r=e.find(a=>a.name===i),o=r&&AR.ExtraBytes.getDimension(r);if(o)return{...t,[i]:o};throw new Error(`Failed to look up LAS type: ${i}`)},{})}});var cg=zt(vf=>{"use strict";Object.defineProperty(vf,"__esModule",{value:!0});vf.Extractor=void 0;var tr=hs();vf.Extractor={create:DR};function PR(n){switch(n){case 0:return 20;case 1:return 28;case 2:return 26;case 3:return 34;case 6:return 30;case 7:return 36;case 8:return 38;default:throw new Error(`Unsupported point data record format: ${n}`)}}function IR(n,e,{type:t,length:i}){let s=_o(n);switch(t){case"signed":switch(i){case 1:return(r,o)=>r.getInt8(s(o)+e);case 2:return(r,o)=>r.getInt16(s(o)+e,!0);case 4:return(r,o)=>r.getInt32(s(o)+e,!0);case 8:return(r,o)=>(0,tr.parseBigInt)(r.getBigInt64(s(o)+e,!0))}case"unsigned":switch(i){case 1:return(r,o)=>r.getUint8(s(o)+e);case 2:return(r,o)=>r.getUint16(s(o)+e,!0);case 4:return(r,o)=>r.getUint32(s(o)+e,!0);case 8:return(r,o)=>(0,tr.parseBigInt)((0,tr.getBigUint64)(r,s(o)+e,!0))}case"float":switch(i){case 4:return(r,o)=>r.getFloat32(s(o)+e,!0);case 8:return(r,o)=>r.getFloat64(s(o)+e,!0)}}}function LR(n,e){let i=PR(n.pointDataRecordFormat);return e.reduce((s,r)=>{let o=i;i+=r.length;let a=IR(n,o,r);if(!a)return s;let l=(c,u)=>tr.Scale.unapply(a(c,u),r.scale,r.offset);return{...s,[r.name]:l}},{})}function DR(n,e=[]){let t=LR(n,e);return{...(()=>{let{pointDataRecordFormat:s}=n;switch(s){case 0:return _f(n);case 1:return NR(n);case 2:return UR(n);case 3:return OR(n);case 6:return mx(n);case 7:return gx(n);case 8:return FR(n);default:throw new Error(`Unsupported point data record format: ${s}`)}})(),...t}}function _f(n){let{scale:e,offset:t}=n,i=_o(n);function s(a,l){return a.getUint8(i(l)+14)}function r(a,l){return a.getUint8(i(l)+15)}function o(a,l){return r(a,l)&31}return{X:(a,l)=>tr.Scale.unapply(a.getInt32(i(l),!0),e[0],t[0]),Y:(a,l)=>tr.Scale.unapply(a.getInt32(i(l)+4,!0),e[1],t[1]),Z:(a,l)=>tr.Scale.unapply(a.getInt32(i(l)+8,!0),e[2],t[2]),Intensity:(a,l)=>a.getUint16(i(l)+12,!0),ReturnNumber:(a,l)=>s(a,l)&7,NumberOfReturns:(a,l)=>(s(a,l)&56)>>3,ScanDirectionFlag:(a,l)=>(s(a,l)&64)>>6,EdgeOfFlightLine:(a,l)=>(s(a,l)&128)>>7,Classification:(a,l)=>{let c=o(a,l);return c===12?0:c},Synthetic:(a,l)=>(r(a,l)&32)>>5,KeyPoint:(a,l)=>(r(a,l)&64)>>6,Withheld:(a,l)=>(r(a,l)&128)>>7,Overlap:(a,l)=>o(a,l)===12?1:0,ScanAngle:(a,l)=>a.getInt8(i(l)+16),UserData:(a,l)=>a.getUint8(i(l)+17),PointSourceId:(a,l)=>a.getUint16(i(l)+18,!0)}}function NR(n){let e=_o(n);return{..._f(n),GpsTime:(t,i)=>t.getFloat64(e(i)+20,!0)}}function UR(n){let e=_o(n);return{..._f(n),Red:(t,i)=>t.getUint16(e(i)+20,!0),Green:(t,i)=>t.getUint16(e(i)+22,!0),Blue:(t,i)=>t.getUint16(e(i)+24,!0)}}function OR(n){let e=_o(n);return{..._f(n),GpsTime:(t,i)=>t.getFloat64(e(i)+20,!0),Red:(t,i)=>t.getUint16(e(i)+28,!0),Green:(t,i)=>t.getUint16(e(i)+30,!0),Blue:(t,i)=>t.getUint16(e(i)+32,!0)}}function mx(n){let{scale:e,offset:t}=n,i=_o(n);function s(r,o){return r.getUint8(i(o)+15)}return{X:(r,o)=>tr.Scale.unapply(r.getInt32(i(o),!0),e[0],t[0]),Y:(r,o)=>tr.Scale.unapply(r.getInt32(i(o)+4,!0),e[1],t[1]),Z:(r,o)=>tr.Scale.unapply(r.getInt32(i(o)+8,!0),e[2],t[2]),Intensity:(r,o)=>r.getUint16(i(o)+12,!0),ReturnNumber:(r,o)=>r.getUint16(i(o)+14,!0)&15,NumberOfReturns:(r,o)=>(r.getUint16(i(o)+14,!0)&240)>>4,Synthetic:(r,o)=>s(r,o)&1,KeyPoint:(r,o)=>(s(r,o)&2)>>1,Withheld:(r,o)=>(s(r,o)&4)>>2,Overlap:(r,o)=>(s(r,o)&8)>>3,ScannerChannel:(r,o)=>(s(r,o)&48)>>4,ScanDirectionFlag:(r,o)=>(s(r,o)&64)>>6,EdgeOfFlightLine:(r,o)=>(s(r,o)&128)>>7,Classification:(r,o)=>r.getUint8(i(o)+16),UserData:(r,o)=>r.getUint8(i(o)+17),ScanAngle:(r,o)=>r.getInt16(i(o)+18,!0)*.006,PointSourceId:(r,o)=>r.getUint16(i(o)+20,!0),GpsTime:(r,o)=>r.getFloat64(i(o)+22,!0)}}function gx(n){let e=_o(n);return{...mx(n),Red:(t,i)=>t.getUint16(e(i)+30,!0),Green:(t,i)=>t.getUint16(e(i)+32,!0),Blue:(t,i)=>t.getUint16(e(i)+34,!0)}}function FR(n){let e=_o(n);return{...gx(n),Infrared:(t,i)=>t.getUint16(e(i)+36,!0)}}function _o(n){let{pointDataRecordLength:e}=n;return function(i){return i*e}}});var vx=zt(wl=>{"use strict";Object.defineProperty(wl,"__esModule",{value:!0});wl.formatGuid=wl.parsePoint=void 0;var _x=hs();function BR(n){let e=_x.Binary.toDataView(n);if(e.byteLength!==24)throw new Error(`Invalid tuple buffer length: ${e.byteLength}`);return[e.getFloat64(0,!0),e.getFloat64(8,!0),e.getFloat64(16,!0)]}wl.parsePoint=BR;function kR(n){let e=_x.Binary.toDataView(n);if(e.byteLength!==16)throw new Error(`Invalid GUID buffer length: ${e.byteLength}`);let t="";for(let i=0;i<e.byteLength;i+=4){let s=e.getUint32(i,!0);t+=s.toString(16).padStart(8,"0")}return[t.slice(0,8),t.slice(8,12),t.slice(12,16),t.slice(16,32)].join("-")}wl.formatGuid=kR});var hg=zt(yf=>{"use strict";Object.defineProperty(yf,"__esModule",{value:!0});yf.Header=void 0;var ki=hs(),yx=cf(),ug=vx();yf.Header={parse:zR};function zR(n){if(n.byteLength<yx.minHeaderLength)throw new Error(`Invalid header: must be at least ${yx.minHeaderLength} bytes`);let e=ki.Binary.toDataView(n),t=ki.Binary.toCString(n.slice(0,4));if(t!=="LASF")throw new Error(`Invalid file signature: ${t}`);let i=e.getUint8(24),s=e.getUint8(25);if(i!==1||s!==2&&s!==4)throw new Error(`Invalid version (only 1.2 and 1.4 supported): ${i}.${s}`);let r={fileSignature:t,fileSourceId:e.getUint16(4,!0),globalEncoding:e.getUint16(6,!0),projectId:(0,ug.formatGuid)(n.slice(8,24)),majorVersion:i,minorVersion:s,systemIdentifier:ki.Binary.toCString(n.slice(26,58)),generatingSoftware:ki.Binary.toCString(n.slice(58,90)),fileCreationDayOfYear:e.getUint16(90,!0),fileCreationYear:e.getUint16(92,!0),headerLength:e.getUint16(94,!0),pointDataOffset:e.getUint32(96,!0),vlrCount:e.getUint32(100,!0),pointDataRecordFormat:e.getUint8(104)&15,pointDataRecordLength:e.getUint16(105,!0),pointCount:e.getUint32(107,!0),pointCountByReturn:HR(n.slice(111,131)),scale:(0,ug.parsePoint)(n.slice(131,155)),offset:(0,ug.parsePoint)(n.slice(155,179)),min:[e.getFloat64(187,!0),e.getFloat64(203,!0),e.getFloat64(219,!0)],max:[e.getFloat64(179,!0),e.getFloat64(195,!0),e.getFloat64(211,!0)],waveformDataOffset:0,evlrOffset:0,evlrCount:0};return s==2?r:{...r,pointCount:(0,ki.parseBigInt)((0,ki.getBigUint64)(e,247,!0)),pointCountByReturn:VR(n.slice(255,375)),waveformDataOffset:(0,ki.parseBigInt)((0,ki.getBigUint64)(e,227,!0)),evlrOffset:(0,ki.parseBigInt)((0,ki.getBigUint64)(e,235,!0)),evlrCount:e.getUint32(243,!0)}}function VR(n){let e=ki.Binary.toDataView(n),t=[];for(let i=0;i<120;i+=8)t.push((0,ki.getBigUint64)(e,i,!0));return t.map(i=>(0,ki.parseBigInt)(i))}function HR(n){let e=ki.Binary.toDataView(n),t=[];for(let i=0;i<20;i+=4)t.push(e.getUint32(i,!0));return t}});var xx={};ap(xx,{createLazPerf:()=>GR,default:()=>$R});var $R,GR,bx=op(()=>{$R=void 0,GR=void 0});var Tx=zt(vo=>{"use strict";Object.defineProperty(vo,"__esModule",{value:!0});vo.decompressFile=vo.decompressChunk=vo.PointData=void 0;var Sx=(bx(),lp(xx)),WR=hg();vo.PointData={createLazPerf:Sx.createLazPerf,decompressChunk:wx,decompressFile:Ex};var dg;async function Mx(n){return n||(dg||(dg=(0,Sx.createLazPerf)()),dg)}async function wx(n,{pointCount:e,pointDataRecordFormat:t,pointDataRecordLength:i},s){let r=await Mx(s),o=new Uint8Array(e*i),a=r._malloc(n.byteLength),l=r._malloc(i),c=new r.ChunkDecoder;try{r.HEAPU8.set(new Uint8Array(n.buffer,n.byteOffset,n.byteLength),a),c.open(t,i,a);for(let u=0;u<e;++u)c.getPoint(l),o.set(new Uint8Array(r.HEAPU8.buffer,l,i),u*i)}finally{r._free(a),r._free(l),c.delete()}return o}vo.decompressChunk=wx;async function Ex(n,e){let t=await Mx(e),i=WR.Header.parse(n),{pointCount:s,pointDataRecordLength:r}=i,o=new Uint8Array(s*r),a=t._malloc(n.byteLength),l=t._malloc(r),c=new t.LASZip;try{t.HEAPU8.set(new Uint8Array(n.buffer,n.byteOffset,n.byteLength),a),c.open(a,n.byteLength);for(let u=0;u<s;++u)c.getPoint(l),o.set(new Uint8Array(t.HEAPU8.buffer,l,r),u*r)}finally{c.delete()}return o}vo.decompressFile=Ex});var Ax=zt(xf=>{"use strict";Object.defineProperty(xf,"__esModule",{value:!0});xf.View=void 0;var XR=hs(),qR=lg(),YR=cg();xf.View={create:jR};function jR(n,e,t=[],i){let s=YR.Extractor.create(e,t);if(i){let u=new Set([...i]);s=Object.entries(s).reduce((h,[d,f])=>(u.has(d)&&(h[d]=f),h),{})}let r=qR.Dimensions.create(s,t),o=XR.Binary.toDataView(n),a=e.pointDataRecordLength;if(o.byteLength%a!==0)throw new Error(`Invalid buffer length (${o.byteLength}) for point length ${a}`);let l=o.byteLength/e.pointDataRecordLength;function c(u){let h=s[u];if(!h)throw new Error(`No extractor for dimension: ${u}`);return function(d){if(d>=l)throw new RangeError(`View index (${d}) out of range: ${l}`);return h(o,d)}}return{pointCount:l,dimensions:r,getter:c}}});var Ix=zt(bf=>{"use strict";Object.defineProperty(bf,"__esModule",{value:!0});bf.Vlr=void 0;var nr=hs(),El=cf();bf.Vlr={walk:KR,parse:Px,find:Rx,at:ZR,fetch:JR};function Rx(n,e,t){return n.find(i=>i.userId===e&&i.recordId===t)}function ZR(n,e,t){let i=Rx(n,e,t);if(!i)throw new Error(`VLR not found: ${e}/${t}`);return i}function JR(n,{contentOffset:e,contentLength:t}){return t===0?new Uint8Array:nr.Getter.create(n)(e,e+t)}async function KR(n,e){let t=nr.Getter.create(n),i=await Cx({get:t,startOffset:e.headerLength,count:e.vlrCount,isExtended:!1}),s=await Cx({get:t,startOffset:e.evlrOffset,count:e.evlrCount,isExtended:!0});return[...i,...s]}function Px(n,e){return(e?e2:QR)(n)}function QR(n){let e=nr.Binary.toDataView(n);if(e.byteLength!==El.vlrHeaderLength)throw new Error(`Invalid VLR header length (must be ${El.vlrHeaderLength}): ${e.byteLength}`);return{userId:nr.Binary.toCString(n.slice(2,18)),recordId:e.getUint16(18,!0),contentLength:e.getUint16(20,!0),description:nr.Binary.toCString(n.slice(22,54)),isExtended:!1}}function e2(n){let e=nr.Binary.toDataView(n);if(e.byteLength!==El.evlrHeaderLength)throw new Error(`Invalid EVLR header length (must be ${El.evlrHeaderLength}): ${e.byteLength}`);return{userId:nr.Binary.toCString(n.slice(2,18)),recordId:e.getUint16(18,!0),contentLength:(0,nr.parseBigInt)((0,nr.getBigUint64)(e,20,!0)),description:nr.Binary.toCString(n.slice(28,60)),isExtended:!0}}async function Cx({get:n,startOffset:e,count:t,isExtended:i}){let s=[],r=e,o=i?El.evlrHeaderLength:El.vlrHeaderLength;for(let a=0;a<t;++a){let l=o?await n(r,r+o):new Uint8Array,{userId:c,recordId:u,contentLength:h,description:d}=Px(l,i);s.push({userId:c,recordId:u,contentOffset:r+o,contentLength:h,description:d,isExtended:i}),r+=o+h}return s}});var fg=zt(on=>{"use strict";var t2=on&&on.__createBinding||(Object.create?(function(n,e,t,i){i===void 0&&(i=t);var s=Object.getOwnPropertyDescriptor(e,t);(!s||("get"in s?!e.__esModule:s.writable||s.configurable))&&(s={enumerable:!0,get:function(){return e[t]}}),Object.defineProperty(n,i,s)}):(function(n,e,t,i){i===void 0&&(i=t),n[i]=e[t]})),n2=on&&on.__setModuleDefault||(Object.create?(function(n,e){Object.defineProperty(n,"default",{enumerable:!0,value:e})}):function(n,e){n.default=e}),i2=on&&on.__importStar||function(n){if(n&&n.__esModule)return n;var e={};if(n!=null)for(var t in n)t!=="default"&&Object.prototype.hasOwnProperty.call(n,t)&&t2(e,n,t);return n2(e,n),e};Object.defineProperty(on,"__esModule",{value:!0});on.Vlr=on.View=on.PointData=on.Header=on.Extractor=on.ExtraBytes=on.Dimensions=on.Constants=void 0;on.Constants=i2(cf());var s2=lg();Object.defineProperty(on,"Dimensions",{enumerable:!0,get:function(){return s2.Dimensions}});var r2=ag();Object.defineProperty(on,"ExtraBytes",{enumerable:!0,get:function(){return r2.ExtraBytes}});var o2=cg();Object.defineProperty(on,"Extractor",{enumerable:!0,get:function(){return o2.Extractor}});var a2=hg();Object.defineProperty(on,"Header",{enumerable:!0,get:function(){return a2.Header}});var l2=Tx();Object.defineProperty(on,"PointData",{enumerable:!0,get:function(){return l2.PointData}});var c2=Ax();Object.defineProperty(on,"View",{enumerable:!0,get:function(){return c2.View}});var u2=Ix();Object.defineProperty(on,"Vlr",{enumerable:!0,get:function(){return u2.Vlr}})});var pg=zt(Sf=>{"use strict";Object.defineProperty(Sf,"__esModule",{value:!0});Sf.Hierarchy=void 0;var uu=hs(),Lx=lf();Sf.Hierarchy={parse:Dx,load:h2};function Dx(n){let e=uu.Binary.toDataView(n);if(e.byteLength%Lx.hierarchyItemLength!==0)throw new Error(`Invalid hierarchy page length: ${e.byteLength}`);let t={},i={};for(let s=0;s<e.byteLength;s+=Lx.hierarchyItemLength){let r=e.getInt32(s+0,!0),o=e.getInt32(s+4,!0),a=e.getInt32(s+8,!0),l=e.getInt32(s+12,!0),c=(0,uu.parseBigInt)((0,uu.getBigUint64)(e,s+16,!0)),u=e.getInt32(s+24,!0),h=e.getInt32(s+28,!0),d=uu.Key.toString([r,o,a,l]);if(h<-1)throw new Error(`Invalid hierarchy point count at key: ${d}`);h===-1?i[d]={pageOffset:c,pageLength:u}:t[d]={pointCount:h,pointDataOffset:c,pointDataLength:u}}return{nodes:t,pages:i}}async function h2(n,e){let t=uu.Getter.create(n);return Dx(await t(e.pageOffset,e.pageOffset+e.pageLength))}});var mg=zt(Mf=>{"use strict";Object.defineProperty(Mf,"__esModule",{value:!0});Mf.Info=void 0;var hu=hs(),Nx=lf();Mf.Info={parse:d2};function d2(n){let e=hu.Binary.toDataView(n);if(e.byteLength!==Nx.infoLength)throw new Error(`Invalid COPC info VLR length (should be ${Nx.infoLength}): ${e.byteLength}`);let t=[e.getFloat64(0,!0),e.getFloat64(8,!0),e.getFloat64(16,!0)],i=e.getFloat64(24,!0);return{cube:[t[0]-i,t[1]-i,t[2]-i,t[0]+i,t[1]+i,t[2]+i],spacing:e.getFloat64(32,!0),rootHierarchyPage:{pageOffset:(0,hu.parseBigInt)((0,hu.getBigUint64)(e,40,!0)),pageLength:(0,hu.parseBigInt)((0,hu.getBigUint64)(e,48,!0))},gpsTimeRange:[e.getFloat64(56,!0),e.getFloat64(64,!0)]}}});var Fx=zt(ir=>{"use strict";var f2=ir&&ir.__createBinding||(Object.create?(function(n,e,t,i){i===void 0&&(i=t);var s=Object.getOwnPropertyDescriptor(e,t);(!s||("get"in s?!e.__esModule:s.writable||s.configurable))&&(s={enumerable:!0,get:function(){return e[t]}}),Object.defineProperty(n,i,s)}):(function(n,e,t,i){i===void 0&&(i=t),n[i]=e[t]})),p2=ir&&ir.__setModuleDefault||(Object.create?(function(n,e){Object.defineProperty(n,"default",{enumerable:!0,value:e})}):function(n,e){n.default=e}),m2=ir&&ir.__importStar||function(n){if(n&&n.__esModule)return n;var e={};if(n!=null)for(var t in n)t!=="default"&&Object.prototype.hasOwnProperty.call(n,t)&&f2(e,n,t);return p2(e,n),e};Object.defineProperty(ir,"__esModule",{value:!0});ir.Copc=void 0;var ds=m2(fg()),wf=hs(),g2=pg(),_2=mg();ir.Copc={create:v2,loadHierarchyPage:y2,loadCompressedPointDataBuffer:Ux,loadPointDataBuffer:Ox,loadPointDataView:x2};async function v2(n){let e=wf.Getter.create(n),t=65536,i=e(0,t);async function s(f,m){return m>=t?e(f,m):(await i).slice(f,m)}let r=ds.Header.parse(await s(0,ds.Constants.minHeaderLength)),o=await ds.Vlr.walk(s,r),a=ds.Vlr.find(o,"copc",1);if(!a)throw new Error("COPC info VLR is required");let l=_2.Info.parse(await ds.Vlr.fetch(s,a)),c,u=ds.Vlr.find(o,"LASF_Projection",2112);u&&u.contentLength&&(c=wf.Binary.toCString(await ds.Vlr.fetch(s,u)),c===""&&(c=void 0));let h=[],d=ds.Vlr.find(o,"LASF_Spec",4);return d&&(h=ds.ExtraBytes.parse(await ds.Vlr.fetch(s,d))),{header:r,vlrs:o,info:l,wkt:c,eb:h}}async function y2(n,e){let t=wf.Getter.create(n);return g2.Hierarchy.load(t,e)}async function Ux(n,{pointDataOffset:e,pointDataLength:t}){return wf.Getter.create(n)(e,e+t)}async function Ox(n,{pointDataRecordFormat:e,pointDataRecordLength:t},i,s){let r=await Ux(n,i),{pointCount:o}=i;return ds.PointData.decompressChunk(r,{pointCount:o,pointDataRecordFormat:e,pointDataRecordLength:t},s)}async function x2(n,e,t,{lazPerf:i,include:s}={}){let r=await Ox(n,e.header,t,i);return ds.View.create(r,e.header,e.eb,s)}});var Bx=zt(gi=>{"use strict";var b2=gi&&gi.__createBinding||(Object.create?(function(n,e,t,i){i===void 0&&(i=t);var s=Object.getOwnPropertyDescriptor(e,t);(!s||("get"in s?!e.__esModule:s.writable||s.configurable))&&(s={enumerable:!0,get:function(){return e[t]}}),Object.defineProperty(n,i,s)}):(function(n,e,t,i){i===void 0&&(i=t),n[i]=e[t]})),S2=gi&&gi.__setModuleDefault||(Object.create?(function(n,e){Object.defineProperty(n,"default",{enumerable:!0,value:e})}):function(n,e){n.default=e}),M2=gi&&gi.__importStar||function(n){if(n&&n.__esModule)return n;var e={};if(n!=null)for(var t in n)t!=="default"&&Object.prototype.hasOwnProperty.call(n,t)&&b2(e,n,t);return S2(e,n),e};Object.defineProperty(gi,"__esModule",{value:!0});gi.Info=gi.Hierarchy=gi.Copc=gi.Constants=void 0;gi.Constants=M2(lf());var w2=Fx();Object.defineProperty(gi,"Copc",{enumerable:!0,get:function(){return w2.Copc}});var E2=pg();Object.defineProperty(gi,"Hierarchy",{enumerable:!0,get:function(){return E2.Hierarchy}});var T2=mg();Object.defineProperty(gi,"Info",{enumerable:!0,get:function(){return T2.Info}})});var Hx=zt(_i=>{"use strict";var kx=_i&&_i.__createBinding||(Object.create?(function(n,e,t,i){i===void 0&&(i=t);var s=Object.getOwnPropertyDescriptor(e,t);(!s||("get"in s?!e.__esModule:s.writable||s.configurable))&&(s={enumerable:!0,get:function(){return e[t]}}),Object.defineProperty(n,i,s)}):(function(n,e,t,i){i===void 0&&(i=t),n[i]=e[t]})),A2=_i&&_i.__setModuleDefault||(Object.create?(function(n,e){Object.defineProperty(n,"default",{enumerable:!0,value:e})}):function(n,e){n.default=e}),zx=_i&&_i.__importStar||function(n){if(n&&n.__esModule)return n;var e={};if(n!=null)for(var t in n)t!=="default"&&Object.prototype.hasOwnProperty.call(n,t)&&kx(e,n,t);return A2(e,n),e},Vx=_i&&_i.__exportStar||function(n,e){for(var t in n)t!=="default"&&!Object.prototype.hasOwnProperty.call(e,t)&&kx(e,n,t)};Object.defineProperty(_i,"__esModule",{value:!0});_i.Las=_i.Ept=void 0;_i.Ept=zx(qy());Vx(Bx(),_i);_i.Las=zx(fg());Vx(hs(),_i)});var Rt,P0,hp,Hr,cp,Pu,I0,Cu,L0,dp,up,MM,jl=Symbol.for("pv"),Iu={},Lu=[],wM=/^m(i|n|o|s|text|space)$/,fp=Array.isArray,pp=Lu.slice,Ro=Object.assign;function Co(n){n&&n.parentNode&&n.remove()}function Du(n,e,t){var i,s,r,o={},a=arguments.length;for(r in e)r=="key"?i=e[r]:r=="ref"&&typeof n!="function"?s=e[r]:o[r]=e[r];return a>2&&(o.children=a>3?pp.call(arguments,2):t),Yl(n,o,i,s,null)}function Yl(n,e,t,i,s){var r={type:n,props:e,key:t,ref:i,__k:null,__:null,__b:0,__e:null,__c:null,constructor:jl,__v:s||++P0,__i:-1,__u:0};return!s&&Rt.vnode&&Rt.vnode(r),r}function Po(n){return n.children}function Ea(n,e){this.props=n,this.context=e,this.__g=0}function $r(n,e){if(e==null)return n.__&&$r(n.__,n.__i+1);for(var t;e<n.__k.length;e++)if((t=n.__k[e])&&t.__e)return t.__e;return typeof n.type!="function"||n.props.__P?null:$r(n)}function EM(n){var e,t=n.__v,i=t.__e,s=[],r=[],o=n.__P;o&&((e=Ro({constructor:jl},t)).__v=t.__v+1,Rt.vnode&&Rt.vnode(e),mp(o,e,t,n.__n,o.namespaceURI,32&t.__u?[i]:null,s,i||$r(t),32&t.__u,r),e.__v=t.__v,e.__.__k[e.__i]=e,B0(s,e,r),t.__=t.__e=null,e.__e!=i&&D0(e))}function D0(n){if((n=n.__)&&n.__c&&!n.props.__P)return n.__e=null,n.__k.some(function(e){return e&&(n.__e=e.__e)}),D0(n)}function C0(n){(8&n.__g||(n.__g|=8,Hr.push(n),Pu++))&&cp==Rt.debounceRendering||((cp=Rt.debounceRendering)||queueMicrotask)(N0)}function N0(){try{for(var n,e=1;Hr.length;)Hr.length>e&&Hr.sort(I0),n=Hr.shift(),e=Hr.length,8&n.__g&&EM(n)}finally{(Pu=Hr.length)&&(cp||queueMicrotask)(N0)}}function U0(n,e,t,i,s,r,o,a,l,c,u){var h,d,f,m,y,g,p=i.__k||Lu,x=e.length;for(l=TM(t,e,p,l,x),h=0;h<x;h++)(f=t.__k[h])!=null&&(d=~f.__i&&p[f.__i]||Iu,f.__i=h,g=mp(n,f,d,s,r,o,a,l,c,u),m=f.__e,(d.ref!=f.ref||8&d.__u)&&(d.ref&&gp(d.ref,null,f,d),f.ref&&u.push(f.ref,f.__c||m,f)),y=y||m,4&f.__u?(l=O0(f,l,n,!d.__v),d.__e&&(d.__e=null)):typeof f.type=="function"&&g!==void 0?l=g:m&&(l=m.nextSibling),f.__u&=-21);return t.__e=y,l}function TM(n,e,t,i,s){var r,o,a,l,c,u,h,d,f,m=t.length,y=m,g=0,p=0,x=n.__k=Array(s);for(r=0;r<s;r++)(o=e[r])!=null&&typeof o!="boolean"&&typeof o!="function"?(typeof o!="object"||o.constructor===String?o=x[r]=Yl(null,o):fp(o)?o=x[r]=Yl(Po,{children:o}):o.constructor===jl&&o.__b?o=x[r]=Yl(o.type,o.props,o.key,o.ref,o.__v):x[r]=o,l=r+g,o.__=n,o.__b=n.__b+1,a=null,~(c=o.__i=AM(o,t,l,y))&&(y--,(a=t[c])&&(a.__u|=2)),a&&a.__v?(o.__u|=16,c==l-1?g--:c==l+1?g++:c!=l&&(c>l?g--:g++,p=1)):(~c||(s>m?g--:s<m&&g++),typeof o.type!="function"&&(o.__u|=4))):x[r]=null;if(p){for(u=[],h=[],r=0;r<s;r++)if((o=x[r])&&16&o.__u){for(g=0,d=u.length;g<d;)u[f=g+d>>1]<o.__i?g=f+1:d=f;u[g]=o.__i,h[r]=g+1}for(g=u.length;r--;)h[r]&&(h[r]==g?g--:x[r].__u|=4)}if(y)for(r=0;r<m;r++)!(a=t[r])||2&a.__u||(a.__e==i&&(i=$r(a)),_p(a,a));return i}function O0(n,e,t,i){var s,r,o,a;if(typeof n.type=="function"){if(n.props.__P)return e;if(s=n.__k)for(r=0;r<s.length;r++)s[r]&&(s[r].__=n,e=O0(s[r],e,t,!1));return e}for(e&&!e.parentNode&&(e=$r(n))&&!e.parentNode&&(e=null),o=n.__e,a=e;a&&a.nodeType==8;)a=a.nextSibling;for(o!=a&&(!i&&t.moveBefore&&o.parentNode?t.moveBefore(o,e):t.insertBefore(o,e||null)),e=o;(e=e&&e.nextSibling)&&e.nodeType==8&&!e.data.startsWith("$s"););return e}function AM(n,e,t,i){var s,r=n.key,o=n.type,a=e[t],l=a&&!(2&a.__u);if(a===null&&r==null||l&&r==a.key&&o==a.type)return t;if(i>(l?1:0)){for(s=t-1;s>=0;s--)if((a=e[s])&&!(2&a.__u)&&r==a.key&&o==a.type)return s;for(s=t+1;s<e.length;s++)if((a=e[s])&&!(2&a.__u)&&r==a.key&&o==a.type)return s}return-1}function R0(n,e,t){t==null&&(t=""),e[0]=="-"?n.setProperty(e,t):n[e]=t}function Au(n,e,t,i,s){var r,o;if(e=="style")if(typeof t=="string")n.style.cssText=t;else{if(typeof i=="string"&&(n.style.cssText=i=""),i)for(e in i)t&&e in t||R0(n.style,e);if(t)for(e in t)i&&t[e]==i[e]||R0(n.style,e,t[e])}else if(e[0]=="o"&&e[1]=="n")typeof t!="function"&&(t=null),typeof i!="function"&&(i=null),(n.__e||(n.__e={}))[e]=t,t&&i||(o=up[e]||(up[e]=CM(e)),(n.__a||(n.__a={}))[e]=dp,r=e!=(e=e.replace(L0,"$1")),(e=e.slice(2))[0]<"a"&&(e=e.toLowerCase()),t?n.addEventListener(e,o,r):n.removeEventListener(e,o,r));else{if(s=="http://www.w3.org/2000/svg")e=e.replace(/xlink(H|:h)/,"h").replace(/sName$/,"s");else if(e!="width"&&e!="height"&&e!="href"&&e!="list"&&e!="form"&&e!="tabIndex"&&e!="download"&&e!="rowSpan"&&e!="colSpan"&&e!="role"&&e!="popover"&&e in n)try{return void(n[e]=t??"")}catch{}if(typeof t=="function")return;t==null||t===!1&&e[4]!="-"?n.removeAttribute(e):n.setAttribute(e,e=="popover"&&t==1?"":t)}}function CM(n){return function(e){var t=this.__e;if(t){if(t=t[n],e[Cu]==null)e[Cu]=dp++;else if(e[Cu]<this.__a[n])return;return t(Rt.event?Rt.event(e):e)}}}function mp(n,e,t,i,s,r,o,a,l,c){var u,h,d,f,m,y,g,p,x,T,b,R,A,v,E,k,U,I,z=e.type;if(e.constructor!==jl)return null;128&t.__u&&(l=32&t.__u,u=t.__c.__z)&&(e.__u|=l,h=r=[],u.nodeType==8?a=Ru(u,r):r.push(u),a=r[0]||a),(u=Rt.__b)&&u(e);e:if(typeof z=="function"){d=o.length;try{if(p=e.props,x=(u=z.prototype)&&u.render,T=(u=z.contextType)&&i[u.__c],b=u?T?T.props.value:u.__:i,(f=t.__c)?(e.__c=f,2&f.__g&&(f.__g|=1)):(x?e.__c=f=new z(p,b):(e.__c=f=new Ea(p,b),f.constructor=z,f.render=PM),T&&T.sub(f),f.state||(f.state={}),f.__n=i,f.__g|=8,f.__h=[],f.__k=[]),x&&(f.__s||(f.__s=f.state),z.getDerivedStateFromProps&&(f.__s==f.state&&(f.__s=Ro({},f.__s)),Ro(f.__s,z.getDerivedStateFromProps(p,f.__s)))),m=f.props,y=f.state,f.__v=e,t.__c){if(p!==m&&x&&!z.getDerivedStateFromProps&&f.componentWillReceiveProps&&f.componentWillReceiveProps(p,b),e.__v==t.__v&&!(8&f.__g)||!(4&f.__g)&&f.shouldComponentUpdate&&f.shouldComponentUpdate(p,f.__s,b)===!1){e.__v!=t.__v&&(f.props=p,f.state=f.__s,f.__g&=-9),e.__e=t.__e,e.__k=t.__k,e.__k.some(function(H){H&&(H.__=e)}),Lu.push.apply(f.__h,f.__k),f.__k=[],f.__h.length&&o.push(f),a=$r(t);break e}f.componentWillUpdate&&f.componentWillUpdate(p,f.__s,b),x&&f.componentDidUpdate&&f.__h.push(function(){f.componentDidUpdate(m,y,g)})}else x&&!z.getDerivedStateFromProps&&f.componentWillMount&&f.componentWillMount(),x&&f.componentDidMount&&f.__h.push(f.componentDidMount);f.context=b,f.props=p,f.__P=n,f.__g&=-5,R=Rt.__r,A=x?25:0;do f.__g&=-9,R&&R(e),u=f.render(f.props,f.state=f.__s,f.context);while(8&f.__g&&++A<25);x&&(Lu.push.apply(f.__h,f.__k),f.__k=[]),f.state=f.__s,f.getChildContext&&(i=Ro({},i,f.getChildContext())),x&&t.__c&&f.getSnapshotBeforeUpdate&&(g=f.getSnapshotBeforeUpdate(m,y)),v=u&&u.type===Po&&u.key==null?u.props.children:u,p.__P&&(u=a,s=(n=p.__P).namespaceURI,l=r=null,t.props&&t.props.__P!=n&&(t.__k.some(function(H){H&&_p(H,H)}),t.__k=null),a=t.__k?$r(t,0):null),a=U0(n,fp(v)?v:[v],e,t,i,s,r,o,a,l,c),p.__P&&(e.__e=null,a=u),e.__u&=-161,h&&h.some(Co),f.__h.length&&o.push(f),1&f.__g&&(f.__g&=-4)}catch(H){if(o.length=d,e.__v=null,l||r)if(H&&H.then){if(e.__u|=128|l,r){for(~(U=r.indexOf(a||void 0))||(U=r.length);(I=r[U-1])&&I.nodeType==8;)U--;for(;U<r.length;U++)if(I=r[U])if(r[U]=null,E){if(I==k)break}else{if(I.nodeType!=8)break;I.data.startsWith("$s")&&(k=Ru(E=I))}}if(!E){for(;a&&a.nodeType==8&&a.nextSibling;)a=a.nextSibling;E=a}(u=Ru(E=e.__c.__z||(e.__c.__z=E)))?(e.__e=E,a=u):e.__e=a,a=a&&a.nextSibling}else r&&r.some(Co);else e.__e=t.__e;e.__k||(e.__k=t.__k||[]),H&&H.then||F0(e),Rt.__e(H,e,t)}}else a=e.__e=RM(t.__e,e,t,i,s,r,o,l,c,n);return(u=Rt.diffed)&&u(e),a}function Ru(n,e){if(n&&n.nodeType==8&&n.data.startsWith("$s"))for(var t=1;n=n.nextSibling;){if(n.nodeType==8){if(n.data.startsWith("$s"))t++;else if(n.data.startsWith("/$s")&&!--t)return n}e&&e.push(n)}}function F0(n){n&&(n.__c&&(n.__c.__g|=4),n.__k&&n.__k.some(F0))}function B0(n,e,t){for(var i=0;i<t.length;)gp(t[i++],t[i++],t[i++]);Rt.__c&&Rt.__c(e,n),n.some(function(s){try{n=s.__h,s.__h=[],n.some(function(r){r.call(s)})}catch(r){Rt.__e(r,s.__v)}})}function RM(n,e,t,i,s,r,o,a,l,c){var u,h,d,f,m,y,g,p,x=t.props||Iu,T=e.props,b=e.type;if(b=="svg"?s="http://www.w3.org/2000/svg":b=="math"?s="http://www.w3.org/1998/Math/MathML":s||(s="http://www.w3.org/1999/xhtml"),r){for(u=0;u<r.length;u++)if((m=r[u])&&(b?m.localName==b:m.nodeType==3)){n=m,r[u]=null;break}}if(!n){if(p=c.ownerDocument||document,!b)return p.createTextNode(T);n=p.createElementNS(s,b,T.is?T:c),a&&(Rt.__m&&Rt.__m(e,r),a=!1),r=null}if(b){if(c=b=="template"&&n.content||n,r=b=="textarea"&&T.defaultValue!=null?null:r&&pp.call(c.childNodes),!a&&r)for(x={},u=0;u<n.attributes.length;u++)x[(m=n.attributes[u]).name]=m.value;for(u in x)m=x[u],u=="dangerouslySetInnerHTML"?d=m:u=="children"||u in T||u=="value"&&"defaultValue"in T||u=="checked"&&"defaultChecked"in T||Au(n,u,null,m,s);for(u in T)m=T[u],u=="children"?f=m:u=="dangerouslySetInnerHTML"?h=m:u=="value"?y=m:u=="checked"?g=m:a&&typeof m!="function"||x[u]===m||Au(n,u,m,x[u],s);h?(a||d&&(h.__html==d.__html||h.__html==n.innerHTML)||(n.innerHTML=h.__html),e.__k=[]):(d&&(n.textContent=""),(b=="foreignObject"||s=="http://www.w3.org/1998/Math/MathML"&&wM.test(b))&&(s="http://www.w3.org/1999/xhtml"),U0(c,fp(f)?f:[f],e,t,i,s,r,o,r?r[0]:t.__k&&$r(t,0),a,l),r&&r.some(Co)),a&&b!="textarea"||(u="value",b=="progress"&&y==null?n.removeAttribute(u):y==null||y===n[u]&&(b!="progress"||y)||Au(n,u,y,x[u],s),u="checked",g!=null&&g!=n[u]&&Au(n,u,g,x[u],s))}else x===T||a&&n.data==T||(n.data=T);return n}function gp(n,e,t,i){try{typeof n=="function"?e?e.__x=n(e)||1:i&&(i=i.__c||i.__e)&&(e=i.__x)&&(i.__x=null,typeof e=="function"?e():n(null)):n.current=e}catch(s){Rt.__e(s,t)}}function _p(n,e,t){var i,s,r,o;if(Rt.unmount&&Rt.unmount(n),!(i=n.ref)||i.current&&i.current!=n.__e||gp(i,null,e,n),i=n.__c){if(i.componentWillUnmount)try{i.componentWillUnmount()}catch(a){Rt.__e(a,e)}i.__P=i.__n=null}if(i=n.__k)for(o=0;o<i.length;o++)i[o]&&_p(i[o],e,typeof n.type!="function"||t&&!n.props.__P);!t&&(i=n.__c)&&(i=i.__z)&&(s=Ru(i,r=[]))&&(i==n.__e&&r.some(Co),Co(s),Co(i)),t||Co(n.__e),n.__e=n.__c=n.__=null}function PM(n,e,t){return this.constructor(n,t)}function k0(n,e){var t,i,s,r;Rt.__&&Rt.__(n,e),e.nodeType==9&&(e=e.documentElement),i=(t=n&&32&n.__u)?null:e.__k,e.__k=Yl(Po,{children:[n]}),s=[],r=[],mp(e,e.__k,i||Iu,Iu,e.namespaceURI,i?null:e.firstChild?pp.call(e.childNodes):null,s,i?i.__e:e.firstChild,t,r),B0(s,e.__k,r),e.__k.props.children=null}Rt={__e:function(n,e,t,i){for(var s,r,o;e=e.__;)if((s=e.__c)&&!(1&s.__g)){s.__g|=4;try{if((o=(r=s.constructor)&&r.getDerivedStateFromError)&&s.setState(r.getDerivedStateFromError(n)),s.componentDidCatch&&(s.componentDidCatch(n,i||{}),o=1),o&&8&s.__g)return void(s.__g|=2)}catch(a){n=a}}throw Pu=0,n}},P0=0,hp=function(n){return n!=null&&n.constructor===jl},Ea.prototype.setState=function(n,e){var t=this.__s;t&&t!=this.state||(t=this.__s=Ro({},this.state)),typeof n=="function"&&(n=n(Ro({},t),this.props)),n&&(Ro(t,n),this.__v&&(e&&this.__k.push(e),C0(this)))},Ea.prototype.forceUpdate=function(n){this.__v&&(this.__g|=4,n&&this.__h.push(n),C0(this))},Ea.prototype.render=Po,Hr=[],Pu=0,I0=function(n,e){return n.__v.__b-e.__v.__b},Cu=Symbol(),L0=/(PointerCapture)$|Capture$/i,dp=0,up={},MM=0;var Ta,An,vp,z0,yp=Object.is,Nu=0,j0=[],xp=[],vn=Rt,V0=vn.__b,H0=vn.__r,$0=vn.diffed,G0=vn.__c,W0=vn.unmount,X0=vn.__;function Uu(n,e){vn.__h&&vn.__h(An,n,Nu||e),Nu=0;var t=An.__H||(An.__H={__:[],__h:[]});return n>=t.__.length&&t.__.push({}),t.__[n]}function ei(n){return Nu=1,IM(J0,n)}function IM(n,e,t){var i=Uu(Ta++,2);if(i.t=n,!i.__c&&(i.__=[t?t(e):J0(void 0,e),function(r){var o=(i.__N||i.__)[0],a=i.t(o,r);yp(o,a)||(i.__N=[a,i.__[1]],i.__c.setState({}))}],i.__c=An,!An.__f)){An.__f=!0;var s=An.shouldComponentUpdate;An.shouldComponentUpdate=function(r,o,a){var l=this.__H;if(!l)return!0;var c=!1,u=this.props!=r;if(l.__.some(function(d){d.__N&&(c=!0,yp(d.__[0],d.__N[0])||(u=!0))}),s){var h=s.call(this,r,o,a);return c?h||u:h}return!c||u}}return i.__}function ur(n,e){var t=Uu(Ta++,3);!vn.__s&&Sp(t.__H,e)&&(t.__P=!0,t.__=n,t.u=e,An.__H.__h.push(t))}function Z0(n,e){var t=Uu(Ta++,4);!vn.__s&&Sp(t.__H,e)&&(t.__P=!1,t.__=n,t.u=e,An.__h.push(t))}function Gr(n){return Nu=5,Ou(function(){return{current:n}},[])}function Ou(n,e){var t=Uu(Ta++,7);return Sp(t.__H,e)&&(t.__=n(),t.__H=e),t.__}function LM(){var n;do{for(;n=xp.shift();)try{Zl(n)}catch(t){vn.__e(t,{__:(n=n.__P)&&n.__v})}for(;n=j0.shift();){var e=n.__H;if(n.__P&&e)try{e.__h.some(Zl),e.__h.some(bp),e.__h=[]}catch(t){e.__h=[],vn.__e(t,n.__v)}}}while(xp.length)}vn.__b=function(n){An=null,V0&&V0(n)},vn.__=function(n,e){n&&e.__k&&e.__k.__m&&(n.__m=e.__k.__m),X0&&X0(n,e)},vn.__r=function(n){H0&&H0(n),Ta=0;var e=(An=n.__c).__H;e&&(vp==An?An.__h=[]:(e.__h.some(Zl),e.__h.some(bp),Ta=0),e.__h=[],e.__.some(function(t){t.__N&&(t.__=t.__N),t.u=t.__N=void 0})),vp=An},vn.diffed=function(n){$0&&$0(n);var e=n.__c;e&&e.__H&&(e.__H.__h.length&&Y0(j0.push(e)),e.__H.__.some(function(t){t.u&&(t.__H=t.u)})),vp=An=null},vn.__c=function(n,e){e.some(function(t){try{t.__h.some(Zl),t.__h=t.__h.filter(function(i){return!i.__||bp(i)})}catch(i){t.__h=[function(){throw i}]}}),G0&&G0(n,e)},vn.unmount=function(n){W0&&W0(n);var e,t,i=n.__c;i&&i.__H&&(i.__H.__.some(function(s){try{if(s.__P&&s.__c){if(t===void 0){for(t=n.__;t&&(!t.__c||!t.__c.__P);)t=t.__;t=t&&t.__c}s.__P=t,Y0(xp.push(s))}else Zl(s)}catch(r){e=r}}),i.__H=void 0,e&&vn.__e(e,i.__v))};var q0=typeof requestAnimationFrame=="function";function DM(n){var e,t=function(){clearTimeout(i),q0&&cancelAnimationFrame(e),setTimeout(n)},i=setTimeout(t,35);q0&&(e=requestAnimationFrame(t))}function Y0(n){n!=1&&z0==vn.requestAnimationFrame||((z0=vn.requestAnimationFrame)||DM)(LM)}function Zl(n){var e=An,t=n.__c;typeof t=="function"&&(n.__c=void 0,t()),An=e}function bp(n){var e=An;n.__c=n.__(),An=e}function Sp(n,e){return!n||n.length!=e.length||e.some(function(t,i){return!yp(t,n[i])})}function J0(n,e){return typeof e=="function"?e(n):e}var NM=Symbol.for("preact-signals");function zu(){if(hr>1)hr--;else{var n,e=!1;for((function(){var s=Bu;for(Bu=void 0;s!==void 0;){var r=s.S;if(r.v===s.v)for(var o=r.t;o!==void 0;o=o.x)o.i===s.i&&(o.i=r.i);s=s.o}})();Kl!==void 0;){var t=Kl;for(Kl=void 0,Fu++;t!==void 0;){var i=t.u;if(t.u=void 0,t.f&=-3,!(8&t.f)&&Q0(t))try{t.c()}catch(s){e||(n=s,e=!0)}t=i}}if(Fu=0,hr--,e)throw n}}function ys(n){if(hr>0)return n();Mp=++UM,hr++;try{return n()}finally{zu()}}var Jl,rn=void 0;function Ql(n){var e=rn,t=Jl;rn=void 0,Jl=void 0;try{return n()}finally{rn=e,Jl=t}}var Kl=void 0,hr=0,Fu=0,UM=0,Mp=0,Bu=void 0,ku=0;function K0(n){if(rn!==void 0){var e=n.n;if(e===void 0||e.t!==rn)return e={i:0,S:n,p:rn.s,n:void 0,t:rn,e:void 0,x:void 0,r:e},rn.s!==void 0&&(rn.s.n=e),rn.s=e,n.n=e,32&rn.f&&n.S(e),e;if(e.i===-1)return e.i=0,e.n!==void 0&&(e.n.p=e.p,e.p!==void 0&&(e.p.n=e.n),e.p=rn.s,e.n=void 0,rn.s.n=e,rn.s=e),e}}function On(n,e){this.v=n,this.i=0,this.n=void 0,this.t=void 0,this.l=0,this.W=e?.watched,this.Z=e?.unwatched,this.name=e?.name}On.prototype.brand=NM;On.prototype.h=function(){return!0};On.prototype.S=function(n){var e=this,t=this.t;t!==n&&n.e===void 0&&(n.x=t,this.t=n,t!==void 0?t.e=n:Ql(function(){var i;(i=e.W)==null||i.call(e)}))};On.prototype.U=function(n){var e=this;if(this.t!==void 0){var t=n.e,i=n.x;t!==void 0&&(t.x=i,n.e=void 0),i!==void 0&&(i.e=t,n.x=void 0),n===this.t&&(this.t=i,i===void 0&&Ql(function(){var s;(s=e.Z)==null||s.call(e)}))}};On.prototype.subscribe=function(n){var e=this;return Yt(function(){var t=e.value;Ql(function(){return n(t)})},{name:"sub"})};On.prototype.valueOf=function(){return this.value};On.prototype.toString=function(){return this.value+""};On.prototype.toJSON=function(){return this.value};On.prototype.peek=function(){var n=this;return Ql(function(){return n.value})};Object.defineProperty(On.prototype,"value",{get:function(){var n=K0(this);return n!==void 0&&(n.i=this.i),this.v},set:function(n){if(n!==this.v){if(Fu>100)throw new Error("Cycle detected");(function(t){hr!==0&&Fu===0&&t.l!==Mp&&(t.l=Mp,Bu={S:t,v:t.v,i:t.i,o:Bu})})(this),this.v=n,this.i++,ku++,hr++;try{for(var e=this.t;e!==void 0;e=e.x)e.t.N()}finally{zu()}}}});function je(n,e){return new On(n,e)}function Q0(n){for(var e=n.s;e!==void 0;e=e.n)if(e.S.i!==e.i||!e.S.h()||e.S.i!==e.i)return!0;return!1}function e_(n){for(var e=n.s;e!==void 0;e=e.n){var t=e.S.n;if(t!==void 0&&(e.r=t),e.S.n=e,e.i=-1,e.n===void 0){n.s=e;break}}}function t_(n){for(var e=n.s,t=void 0;e!==void 0;){var i=e.p;e.i===-1?(e.S.U(e),i!==void 0&&(i.n=e.n),e.n!==void 0&&(e.n.p=i)):t=e,e.S.n=e.r,e.r!==void 0&&(e.r=void 0),e=i}n.s=t}function Io(n,e){On.call(this,void 0,e),this.x=n,this.s=void 0,this.g=ku-1,this.f=4}Io.prototype=new On;Io.prototype.h=function(){if(this.f&=-3,1&this.f)return!1;if((36&this.f)==32||(this.f&=-5,this.g===ku))return!0;if(this.g=ku,this.f|=1,this.i>0&&!Q0(this))return this.f&=-2,!0;var n=rn;try{e_(this),rn=this;var e=this.x();(16&this.f||this.v!==e||this.i===0)&&(this.v=e,this.f&=-17,this.i++)}catch(t){this.v=t,this.f|=16,this.i++}return rn=n,t_(this),this.f&=-2,!0};Io.prototype.S=function(n){if(this.t===void 0){this.f|=36;for(var e=this.s;e!==void 0;e=e.n)e.S.S(e)}On.prototype.S.call(this,n)};Io.prototype.U=function(n){if(this.t!==void 0&&(On.prototype.U.call(this,n),this.t===void 0)){this.f&=-33;for(var e=this.s;e!==void 0;e=e.n)e.S.U(e)}};Io.prototype.N=function(){if(!(2&this.f)){this.f|=6;for(var n=this.t;n!==void 0;n=n.x)n.t.N()}};Object.defineProperty(Io.prototype,"value",{get:function(){if(1&this.f)throw new Error("Cycle detected");var n=K0(this);if(this.h(),n!==void 0&&(n.i=this.i),16&this.f)throw this.v;return this.v}});function $t(n,e){return new Io(n,e)}function n_(n){var e=n.j;if(n.j=void 0,typeof e=="function"){hr++;var t=rn;rn=void 0;try{e()}catch(i){throw n.f&=-2,n.f|=8,wp(n),i}finally{rn=t,zu()}}}function wp(n){for(var e=n.s;e!==void 0;e=e.n)e.S.U(e);n.x=void 0,n.s=void 0,n_(n)}function OM(n){if(rn!==this)throw new Error("Out-of-order effect");t_(this),rn=n,this.f&=-2;try{8&this.f&&wp(this)}finally{zu()}}function Aa(n,e){this.x=n,this.j=void 0,this.s=void 0,this.u=void 0,this.f=32,this.name=e?.name,Jl&&Jl.push(this)}Aa.prototype.c=function(){var n=this.S();try{if(8&this.f||this.x===void 0)return;var e=this.x();typeof e=="function"&&(this.j=e)}finally{n()}};Aa.prototype.S=function(){if(1&this.f)throw new Error("Cycle detected");this.f|=1,this.f&=-9,n_(this),e_(this),hr++;var n=rn;return rn=this,OM.bind(this,n)};Aa.prototype.N=function(){2&this.f||(this.f|=2,this.u=Kl,Kl=this)};Aa.prototype.d=function(){this.f|=8,1&this.f||wp(this)};Aa.prototype.dispose=function(){this.d()};function Yt(n,e){var t=new Aa(n,e);try{t.c()}catch(s){throw t.d(),s}var i=t.d.bind(t);return i[Symbol.dispose]=i,i}var i_,Hu,Vu,FM=typeof window<"u"&&!!window.__PREACT_SIGNALS_DEVTOOLS__;var s_=[];Yt(function(){i_=this.N})();function Ca(n,e){Rt[n]=e.bind(null,Rt[n]||function(){})}function ec(n){if(Vu){var e=Vu;Vu=void 0,e()}Vu=n&&n.S()}function r_(n){var e=this,t=n.data,i=kM(t);i.name="ReactiveDom",i.value=t;var s=Ou(function(){for(var a=e,l=e.__v;l=l.__;)if(l.__c){l.__c.__$f|=4;break}var c=$t(function(){var f=i.value.value;return f===0?0:f===!0?"":f||""}),u=$t(function(){return!Array.isArray(c.value)&&!hp(c.value)}),h=Yt(function(){if(this.N=o_,u.value){var f=c.value;a.__v&&a.__v.__e&&a.__v.__e.nodeType===3&&(a.__v.__e.data=f)}}),d=e.__$u.d;return e.__$u.d=function(){h(),d.call(this)},[u,c]},[]),r=s[0],o=s[1];return r.value?o.peek():o.value}r_.displayName="ReactiveTextNode";Object.defineProperties(On.prototype,{constructor:{configurable:!0,value:Du(Po,null).constructor},type:{configurable:!0,value:r_},props:{configurable:!0,get:function(){var n=this;return{data:{get value(){return n.value}}}}},__b:{configurable:!0,value:1}});Ca("__b",function(n,e){if(ec(),Hu=void 0,typeof e.type=="string"){var t,i=e.props;for(var s in i)if(s!=="children"){var r=i[s];r instanceof On&&(t||(e.__np=t={}),t[s]=r,i[s]=r.peek())}}n(e)});Ca("__r",function(n,e){if(n(e),e.type!==Po){ec();var t,i=e.__c;i&&(i.__$f&=-2,(t=i.__$u)===void 0&&(i.__$u=t=(function(s,r){var o;return Yt(function(){o=this},{name:r}),o.c=s,o})((function(s){return function(){var r;FM&&((r=this.y)==null||r.call(this)),s.__$f|=1,s.setState({})}})(i),typeof e.type=="function"?e.type.displayName||e.type.name:""))),Hu=i,ec(t)}});Ca("__e",function(n,e,t,i){ec(),Hu=void 0,n(e,t,i)});Ca("diffed",function(n,e){ec(),Hu=void 0;var t;if(typeof e.type=="string"&&(t=e.__e)){var i=e.__np,s=e.props,r=t.U;if(r)for(var o in r){var a=r[o];a===void 0||i&&o in i||(a.d(),r[o]=void 0)}if(i){r||(r={},t.U=r);for(var l in i){var c=r[l],u=i[l];c===void 0?(c=BM(t,l,u,s),r[l]=c):c.o(u,s)}}}n(e)});function BM(n,e,t,i){var s=e in n&&n.ownerSVGElement===void 0,r=je(t);return{o:function(o,a){r.value=o,i=a},d:Yt(function(){this.N=o_;var o=r.value.value;i[e]!==o&&(i[e]=o,s?n[e]=o:o!=null&&(o!==!1||e[4]==="-")?n.setAttribute(e,o):n.removeAttribute(e))})}}Ca("unmount",function(n,e){if(typeof e.type=="string"){var t=e.__e;if(t){var i=t.U;if(i){t.U=void 0;for(var s in i){var r=i[s];r&&r.d()}}}var o=e.__np;if(o){var a=e.props;for(var l in o)a[l]=o[l]}e.__np=void 0}else{var c=e.__c;if(c){c.__$f|=8;var u=c.__$u;u&&(c.__$u=void 0,u.d())}}n(e)});Ca("__h",function(n,e,t,i){i<3&&(e.__$f|=2),n(e,t,i)});Ea.prototype.shouldComponentUpdate=function(n,e){if(this.__R)return!0;var t=this.__$u,i=t&&t.s!==void 0;for(var s in e)return!0;if(this.__f||typeof this.u=="boolean"&&this.u===!0){var r=2&this.__$f;if(!(i||r||4&this.__$f)||1&this.__$f)return!0}else if(!(i||4&this.__$f)||3&this.__$f)return!0;for(var o in n)if(o!=="__source"&&n[o]!==this.props[o])return!0;for(var a in this.props)if(!(a in n))return!0;return!1};function kM(n,e){return Ou(function(){return je(n,e)},[])}var zM=function(n){queueMicrotask(function(){queueMicrotask(n)})};function VM(){ys(function(){for(var n;n=s_.shift();)i_.call(n)})}function o_(){s_.push(this)===1&&(Rt.requestAnimationFrame||zM)(VM)}var a_=(n,e=3)=>n.map(t=>Number(t.toFixed(e))).join(",");function Ep(n,e){if(!n)return null;let t=n.split(",").map(Number);return t.length===e&&t.every(Number.isFinite)?t:null}var l_=["colour","tab","sort","text","station","kind","state","theme","select"],c_=["size","edl","ellipsoids","moves"];function u_(n){let e=new URLSearchParams;if(n.camera){let t=n.camera;e.set("camera",a_([...t.eye,t.yaw,t.pitch,t.height],4)),t.ortho&&e.set("ortho","1")}for(let t of l_)n[t]&&e.set(t,n[t]);for(let t of c_)n[t]!==void 0&&n[t]!==null&&e.set(t,String(n[t]));if(n.range&&e.set("range",n.range.map(t=>Number(t.toPrecision(6))).join(",")),n.hidden)for(let t of n.hidden)e.append("hide",t);return n.slice?.on&&e.set("slice",a_([...n.slice.centre,...n.slice.half,n.slice.turn],4)),n.down!==void 0&&e.set("down",n.down?"1":"0"),e.toString()}function h_(n){let e=new URLSearchParams(n.replace(/^#/,"")),t={},i=Ep(e.get("camera"),6);i&&i[5]>0&&(t.camera={eye:i.slice(0,3),yaw:i[3],pitch:i[4],height:i[5],ortho:e.get("ortho")==="1"});for(let o of l_){let a=e.get(o);a&&(t[o]=a.slice(0,400))}for(let o of c_){let a=Number(e.get(o)??NaN);e.has(o)&&Number.isFinite(a)&&a>=0&&(t[o]=a)}let s=Ep(e.get("range"),2);s&&s[0]<s[1]&&(t.range=[s[0],s[1]]),e.has("hide")&&(t.hidden=e.getAll("hide").slice(0,2e3));let r=Ep(e.get("slice"),7);return r&&r.slice(3,6).every(o=>o>0)&&(t.slice={on:!0,centre:r.slice(0,3),half:r.slice(3,6),turn:r[6]}),e.has("down")&&(t.down=e.get("down")==="1"),t}var tc=Object.freeze({text:"",station:"",kind:"",state:"",low:null,high:null}),Tp=n=>n.id?.length??0;function f_(n,e){let t=Tp(n),i=new Int32Array(t),s=e.text.toLowerCase().split(/\s+/).filter(Boolean),r=0;for(let o=0;o<t;o++)if(!(e.station&&n.from[o]!==e.station&&n.to[o]!==e.station)&&!(e.kind&&n.kind[o]!==e.kind)){if(e.state==="suspicious"){if(!n.suspicious[o])continue}else if(e.state&&n.state[o]!==e.state)continue;if(e.low!==null||e.high!==null){let a=n.w[o];if(a==null||e.low!==null&&a<e.low||e.high!==null&&a>e.high)continue}if(s.length){let a=`${n.from[o]} ${n.to[o]} ${n.kind[o]} ${n.component?.[o]??""} ${n.source?.[o]??""} ${n.reason?.[o]??""} ${n.id[o]}`.toLowerCase();if(!s.every(l=>a.includes(l)))continue}i[r++]=o}return i.subarray(0,r)}var HM=new Set(["w","residual","tau"]);function p_(n,e,t,i){let s=n[t];if(!s)return e;let r=Array.from(e),o=c=>c==null||Number.isNaN(c),a=HM.has(t)?c=>o(c)?c:Math.abs(c):c=>c,l=i?-1:1;return r.sort((c,u)=>{let[h,d]=[a(s[c]),a(s[u])];return o(h)||o(d)?o(h)&&o(d)?c-u:o(h)?1:-1:typeof h=="string"?l*h.localeCompare(d,"en",{numeric:!0})||c-u:l*(Number(h)-Number(d))||c-u}),Int32Array.from(r)}function m_(n,e,t,i){let r=Math.max(0,Math.floor(n/t)-8),o=Math.min(i,Math.ceil((n+e)/t)+8);return{first:Math.min(r,o),last:o}}function Ap(n){return[...new Set(n.filter(e=>e!==""&&e!==null&&e!==void 0))].sort((e,t)=>String(e).localeCompare(String(t),"en",{numeric:!0}))}function g_(n,e,t,i){let s=n[0][2],r=Math.max(e,s+Math.max(...n.map(([,,l])=>l))),o=[],a=-1;for(let[l,,c]of n)c>a&&(o.length===1&&d_(o[0],t,a),a=o.length?r-s:r,o.push([])),o[o.length-1].push({name:l,width:c}),a-=c;return d_(o[o.length-1],i,a),{lines:o,width:r}}function d_(n,e,t){let i=n.find(s=>s.name===e);i&&(i.width+=t)}var Y_=0,im=1,j_=2;var Oc=1,Z_=2,nl=3,to=0,Ci=1,os=2,Vo=0,il=1,sm=2,rm=3,om=4,J_=5;var Ho=100,K_=101,Q_=102,ev=103,tv=104,nv=200,iv=201,sv=202,rv=203,am=204,lm=205,ov=206,av=207,lv=208,cv=209,uv=210,hv=211,dv=212,fv=213,pv=214,mh=0,Xa=1,gh=2,qa=3,_h=4,vh=5,yh=6,xh=7,Xh=0,mv=1,gv=2,Ws=0,cm=1,um=2,hm=3,dm=4,fm=5,pm=6,mm=7;var gm=300,$o=301,sl=302,qh=303,Yh=304,bh=1e3,Vs=1001,Sh=1002,Rn=1003,_v=1004;var Fc=1005;var Ti=1006,jh=1007;var br=1008;var di=1009,_m=1010,vm=1011,rl=1012,Zh=1013,Ts=1014,Oi=1015,As=1016,Jh=1017,Kh=1018,Go=1020,ym=35902,xm=35899,bm=1021,Sm=1022,Yi=1023,vr=1026,Sr=1027,Qh=1028,ed=1029,no=1030,td=1031;var nd=1033,Bc=33776,kc=33777,zc=33778,Vc=33779,id=35840,sd=35841,rd=35842,od=35843,ad=36196,ld=37492,cd=37496,ud=37488,hd=37489,Hc=37490,dd=37491,fd=37808,pd=37809,md=37810,gd=37811,_d=37812,vd=37813,yd=37814,xd=37815,bd=37816,Sd=37817,Md=37818,wd=37819,Ed=37820,Td=37821,Ad=36492,Cd=36494,Rd=36495,Pd=36283,Id=36284,$c=36285,Ld=36286;var hc=2300,Mh=2301,fh=2302,jp=2303,Zp=2400,Jp=2401,Kp=2402;var vv=3200;var Dd=0,yv=1,Mr="",Xi="srgb",Oo="srgb-linear",dc="linear",Pt="srgb";var ph=7680;var xv=519,bv=512,Sv=513,Mv=514,Mm=515,wv=516,Ev=517,wm=518,Em=519,Tm=35044;var Wo="300 es",is=2e3,Ya=2001;function $M(n){for(let e=n.length-1;e>=0;--e)if(n[e]>=65535)return!0;return!1}function GM(n){return ArrayBuffer.isView(n)&&!(n instanceof DataView)}function fc(n){return document.createElementNS("http://www.w3.org/1999/xhtml",n)}function Tv(){let n=fc("canvas");return n.style.display="block",n}var __={},ja=null;function pc(...n){let e="THREE."+n.shift();ja?ja("log",e,...n):console.log(e,...n)}function Av(n){let e=n[0];if(typeof e=="string"&&e.startsWith("TSL:")){let t=n[1];t&&t.isStackTrace?n[0]+=" "+t.getLocation():n[1]='Stack trace not available. Enable "THREE.Node.captureStackTrace" to capture stack traces.'}return n}function Ze(...n){n=Av(n);let e="THREE."+n.shift();if(ja)ja("warn",e,...n);else{let t=n[0];t&&t.isStackTrace?console.warn(t.getError(e)):console.warn(e,...n)}}function tt(...n){n=Av(n);let e="THREE."+n.shift();if(ja)ja("error",e,...n);else{let t=n[0];t&&t.isStackTrace?console.error(t.getError(e)):console.error(e,...n)}}function lc(...n){let e=n.join(" ");e in __||(__[e]=!0,Ze(...n))}function Cv(n,e,t){return new Promise(function(i,s){function r(){switch(n.clientWaitSync(e,n.SYNC_FLUSH_COMMANDS_BIT,0)){case n.WAIT_FAILED:s();break;case n.TIMEOUT_EXPIRED:setTimeout(r,t);break;default:i()}}setTimeout(r,t)})}var Rv={[mh]:mh,[gh]:yh,[_h]:_h,[qa]:vh,[Xa]:Xa,[yh]:gh,[xh]:xh,[vh]:qa},Hs=class{addEventListener(e,t){this._listeners===void 0&&(this._listeners={});let i=this._listeners;i[e]===void 0&&(i[e]=[]),i[e].indexOf(t)===-1&&i[e].push(t)}hasEventListener(e,t){let i=this._listeners;return i===void 0?!1:i[e]!==void 0&&i[e].indexOf(t)!==-1}removeEventListener(e,t){let i=this._listeners;if(i===void 0)return;let s=i[e];if(s!==void 0){let r=s.indexOf(t);r!==-1&&s.splice(r,1)}}dispatchEvent(e){let t=this._listeners;if(t===void 0)return;let i=t[e.type];if(i!==void 0){e.target=this;let s=i.slice(0);for(let r=0,o=s.length;r<o;r++)s[r].call(this,e);e.target=null}}},ci=["00","01","02","03","04","05","06","07","08","09","0a","0b","0c","0d","0e","0f","10","11","12","13","14","15","16","17","18","19","1a","1b","1c","1d","1e","1f","20","21","22","23","24","25","26","27","28","29","2a","2b","2c","2d","2e","2f","30","31","32","33","34","35","36","37","38","39","3a","3b","3c","3d","3e","3f","40","41","42","43","44","45","46","47","48","49","4a","4b","4c","4d","4e","4f","50","51","52","53","54","55","56","57","58","59","5a","5b","5c","5d","5e","5f","60","61","62","63","64","65","66","67","68","69","6a","6b","6c","6d","6e","6f","70","71","72","73","74","75","76","77","78","79","7a","7b","7c","7d","7e","7f","80","81","82","83","84","85","86","87","88","89","8a","8b","8c","8d","8e","8f","90","91","92","93","94","95","96","97","98","99","9a","9b","9c","9d","9e","9f","a0","a1","a2","a3","a4","a5","a6","a7","a8","a9","aa","ab","ac","ad","ae","af","b0","b1","b2","b3","b4","b5","b6","b7","b8","b9","ba","bb","bc","bd","be","bf","c0","c1","c2","c3","c4","c5","c6","c7","c8","c9","ca","cb","cc","cd","ce","cf","d0","d1","d2","d3","d4","d5","d6","d7","d8","d9","da","db","dc","dd","de","df","e0","e1","e2","e3","e4","e5","e6","e7","e8","e9","ea","eb","ec","ed","ee","ef","f0","f1","f2","f3","f4","f5","f6","f7","f8","f9","fa","fb","fc","fd","fe","ff"],v_=1234567,cc=Math.PI/180,Za=180/Math.PI;function io(){let n=Math.random()*4294967295|0,e=Math.random()*4294967295|0,t=Math.random()*4294967295|0,i=Math.random()*4294967295|0;return(ci[n&255]+ci[n>>8&255]+ci[n>>16&255]+ci[n>>24&255]+"-"+ci[e&255]+ci[e>>8&255]+"-"+ci[e>>16&15|64]+ci[e>>24&255]+"-"+ci[t&63|128]+ci[t>>8&255]+"-"+ci[t>>16&255]+ci[t>>24&255]+ci[i&255]+ci[i>>8&255]+ci[i>>16&255]+ci[i>>24&255]).toLowerCase()}function ut(n,e,t){return Math.max(e,Math.min(t,n))}function Am(n,e){return(n%e+e)%e}function WM(n,e,t,i,s){return i+(n-e)*(s-i)/(t-e)}function XM(n,e,t){return n!==e?(t-n)/(e-n):0}function uc(n,e,t){return(1-t)*n+t*e}function qM(n,e,t,i){return uc(n,e,1-Math.exp(-t*i))}function YM(n,e=1){return e-Math.abs(Am(n,e*2)-e)}function jM(n,e,t){return n<=e?0:n>=t?1:(n=(n-e)/(t-e),n*n*(3-2*n))}function ZM(n,e,t){return n<=e?0:n>=t?1:(n=(n-e)/(t-e),n*n*n*(n*(n*6-15)+10))}function JM(n,e){return n+Math.floor(Math.random()*(e-n+1))}function KM(n,e){return n+Math.random()*(e-n)}function QM(n){return n*(.5-Math.random())}function ew(n){n!==void 0&&(v_=n);let e=v_+=1831565813;return e=Math.imul(e^e>>>15,e|1),e^=e+Math.imul(e^e>>>7,e|61),((e^e>>>14)>>>0)/4294967296}function tw(n){return n*cc}function nw(n){return n*Za}function iw(n){return n>0&&Number.isInteger(n)&&2**Math.round(Math.log2(n))===n}function sw(n){return Math.pow(2,Math.ceil(Math.log(n)/Math.LN2))}function Cm(n){return Math.pow(2,Math.floor(Math.log(n)/Math.LN2))}function rw(n,e,t,i,s){let r=Math.cos,o=Math.sin,a=r(t/2),l=o(t/2),c=r((e+i)/2),u=o((e+i)/2),h=r((e-i)/2),d=o((e-i)/2),f=r((i-e)/2),m=o((i-e)/2);switch(s){case"XYX":n.set(a*u,l*h,l*d,a*c);break;case"YZY":n.set(l*d,a*u,l*h,a*c);break;case"ZXZ":n.set(l*h,l*d,a*u,a*c);break;case"XZX":n.set(a*u,l*m,l*f,a*c);break;case"YXY":n.set(l*f,a*u,l*m,a*c);break;case"ZYZ":n.set(l*m,l*f,a*u,a*c);break;default:Ze("MathUtils: .setQuaternionFromProperEuler() encountered an unknown order: "+s)}}function Nd(n){switch(n.constructor){case Uint32Array:return 4294967295;case Uint16Array:return 65535;case Uint8Array:case Uint8ClampedArray:return 255;case Int32Array:return 2147483647;case Int16Array:return 32767;case Int8Array:return 127;default:return}}function Rm(n,e){if(e.constructor===Float32Array)return n;let t=Nd(e);if(t===void 0)throw new Error("THREE.MathUtils: Invalid component type.");return Math.max(n/t,-1)}function Pm(n,e){if(e.constructor===Float32Array)return n;let t=Nd(e);if(t===void 0)throw new Error("THREE.MathUtils: Invalid component type.");return Math.round(n*t)}var Im={DEG2RAD:cc,RAD2DEG:Za,generateUUID:io,clamp:ut,euclideanModulo:Am,mapLinear:WM,inverseLerp:XM,lerp:uc,damp:qM,pingpong:YM,smoothstep:jM,smootherstep:ZM,randInt:JM,randFloat:KM,randFloatSpread:QM,seededRandom:ew,degToRad:tw,radToDeg:nw,isPowerOfTwo:iw,ceilPowerOfTwo:sw,floorPowerOfTwo:Cm,setQuaternionFromProperEuler:rw,normalize:Pm,denormalize:Rm},at=class{static{this.prototype.isVector2=!0}constructor(e=0,t=0){this.x=e,this.y=t}get width(){return this.x}set width(e){this.x=e}get height(){return this.y}set height(e){this.y=e}set(e,t){return this.x=e,this.y=t,this}setScalar(e){return this.x=e,this.y=e,this}setX(e){return this.x=e,this}setY(e){return this.y=e,this}setComponent(e,t){switch(e){case 0:this.x=t;break;case 1:this.y=t;break;default:throw new Error("THREE.Vector2: index is out of range: "+e)}return this}getComponent(e){switch(e){case 0:return this.x;case 1:return this.y;default:throw new Error("THREE.Vector2: index is out of range: "+e)}}clone(){return new this.constructor(this.x,this.y)}copy(e){return this.x=e.x,this.y=e.y,this}add(e){return this.x+=e.x,this.y+=e.y,this}addScalar(e){return this.x+=e,this.y+=e,this}addVectors(e,t){return this.x=e.x+t.x,this.y=e.y+t.y,this}addScaledVector(e,t){return this.x+=e.x*t,this.y+=e.y*t,this}sub(e){return this.x-=e.x,this.y-=e.y,this}subScalar(e){return this.x-=e,this.y-=e,this}subVectors(e,t){return this.x=e.x-t.x,this.y=e.y-t.y,this}multiply(e){return this.x*=e.x,this.y*=e.y,this}multiplyScalar(e){return this.x*=e,this.y*=e,this}divide(e){return this.x/=e.x,this.y/=e.y,this}divideScalar(e){return this.multiplyScalar(1/e)}applyMatrix3(e){let t=this.x,i=this.y,s=e.elements;return this.x=s[0]*t+s[3]*i+s[6],this.y=s[1]*t+s[4]*i+s[7],this}min(e){return this.x=Math.min(this.x,e.x),this.y=Math.min(this.y,e.y),this}max(e){return this.x=Math.max(this.x,e.x),this.y=Math.max(this.y,e.y),this}clamp(e,t){return this.x=ut(this.x,e.x,t.x),this.y=ut(this.y,e.y,t.y),this}clampScalar(e,t){return this.x=ut(this.x,e,t),this.y=ut(this.y,e,t),this}clampLength(e,t){let i=this.length();return this.divideScalar(i||1).multiplyScalar(ut(i,e,t))}floor(){return this.x=Math.floor(this.x),this.y=Math.floor(this.y),this}ceil(){return this.x=Math.ceil(this.x),this.y=Math.ceil(this.y),this}round(){return this.x=Math.round(this.x),this.y=Math.round(this.y),this}roundToZero(){return this.x=Math.trunc(this.x),this.y=Math.trunc(this.y),this}negate(){return this.x=-this.x,this.y=-this.y,this}dot(e){return this.x*e.x+this.y*e.y}cross(e){return this.x*e.y-this.y*e.x}lengthSq(){return this.x*this.x+this.y*this.y}length(){return Math.sqrt(this.x*this.x+this.y*this.y)}manhattanLength(){return Math.abs(this.x)+Math.abs(this.y)}normalize(){return this.divideScalar(this.length()||1)}angle(){return Math.atan2(-this.y,-this.x)+Math.PI}angleTo(e){let t=Math.sqrt(this.lengthSq()*e.lengthSq());if(t===0)return Math.PI/2;let i=this.dot(e)/t;return Math.acos(ut(i,-1,1))}distanceTo(e){return Math.sqrt(this.distanceToSquared(e))}distanceToSquared(e){let t=this.x-e.x,i=this.y-e.y;return t*t+i*i}manhattanDistanceTo(e){return Math.abs(this.x-e.x)+Math.abs(this.y-e.y)}setLength(e){return this.normalize().multiplyScalar(e)}lerp(e,t){return this.x+=(e.x-this.x)*t,this.y+=(e.y-this.y)*t,this}lerpVectors(e,t,i){return this.x=e.x+(t.x-e.x)*i,this.y=e.y+(t.y-e.y)*i,this}equals(e){return e.x===this.x&&e.y===this.y}fromArray(e,t=0){return this.x=e[t],this.y=e[t+1],this}toArray(e=[],t=0){return e[t]=this.x,e[t+1]=this.y,e}fromBufferAttribute(e,t){return this.x=e.getX(t),this.y=e.getY(t),this}rotateAround(e,t){let i=Math.cos(t),s=Math.sin(t),r=this.x-e.x,o=this.y-e.y;return this.x=r*i-o*s+e.x,this.y=r*s+o*i+e.y,this}random(){return this.x=Math.random(),this.y=Math.random(),this}*[Symbol.iterator](){yield this.x,yield this.y}},rs=class{constructor(e=0,t=0,i=0,s=1){this.isQuaternion=!0,this._x=e,this._y=t,this._z=i,this._w=s}static slerpFlat(e,t,i,s,r,o,a){let l=i[s+0],c=i[s+1],u=i[s+2],h=i[s+3],d=r[o+0],f=r[o+1],m=r[o+2],y=r[o+3];if(h!==y||l!==d||c!==f||u!==m){let g=l*d+c*f+u*m+h*y;g<0&&(d=-d,f=-f,m=-m,y=-y,g=-g);let p=1-a;if(g<.9995){let x=Math.acos(g),T=Math.sin(x);p=Math.sin(p*x)/T,a=Math.sin(a*x)/T,l=l*p+d*a,c=c*p+f*a,u=u*p+m*a,h=h*p+y*a}else{l=l*p+d*a,c=c*p+f*a,u=u*p+m*a,h=h*p+y*a;let x=1/Math.sqrt(l*l+c*c+u*u+h*h);l*=x,c*=x,u*=x,h*=x}}e[t]=l,e[t+1]=c,e[t+2]=u,e[t+3]=h}static multiplyQuaternionsFlat(e,t,i,s,r,o){let a=i[s],l=i[s+1],c=i[s+2],u=i[s+3],h=r[o],d=r[o+1],f=r[o+2],m=r[o+3];return e[t]=a*m+u*h+l*f-c*d,e[t+1]=l*m+u*d+c*h-a*f,e[t+2]=c*m+u*f+a*d-l*h,e[t+3]=u*m-a*h-l*d-c*f,e}get x(){return this._x}set x(e){this._x=e,this._onChangeCallback()}get y(){return this._y}set y(e){this._y=e,this._onChangeCallback()}get z(){return this._z}set z(e){this._z=e,this._onChangeCallback()}get w(){return this._w}set w(e){this._w=e,this._onChangeCallback()}set(e,t,i,s){return this._x=e,this._y=t,this._z=i,this._w=s,this._onChangeCallback(),this}clone(){return new this.constructor(this._x,this._y,this._z,this._w)}copy(e){return this._x=e.x,this._y=e.y,this._z=e.z,this._w=e.w,this._onChangeCallback(),this}setFromEuler(e,t=!0){let i=e._x,s=e._y,r=e._z,o=e._order,a=Math.cos,l=Math.sin,c=a(i/2),u=a(s/2),h=a(r/2),d=l(i/2),f=l(s/2),m=l(r/2);switch(o){case"XYZ":this._x=d*u*h+c*f*m,this._y=c*f*h-d*u*m,this._z=c*u*m+d*f*h,this._w=c*u*h-d*f*m;break;case"YXZ":this._x=d*u*h+c*f*m,this._y=c*f*h-d*u*m,this._z=c*u*m-d*f*h,this._w=c*u*h+d*f*m;break;case"ZXY":this._x=d*u*h-c*f*m,this._y=c*f*h+d*u*m,this._z=c*u*m+d*f*h,this._w=c*u*h-d*f*m;break;case"ZYX":this._x=d*u*h-c*f*m,this._y=c*f*h+d*u*m,this._z=c*u*m-d*f*h,this._w=c*u*h+d*f*m;break;case"YZX":this._x=d*u*h+c*f*m,this._y=c*f*h+d*u*m,this._z=c*u*m-d*f*h,this._w=c*u*h-d*f*m;break;case"XZY":this._x=d*u*h-c*f*m,this._y=c*f*h-d*u*m,this._z=c*u*m+d*f*h,this._w=c*u*h+d*f*m;break;default:Ze("Quaternion: .setFromEuler() encountered an unknown order: "+o)}return t===!0&&this._onChangeCallback(),this}setFromAxisAngle(e,t){let i=t/2,s=Math.sin(i);return this._x=e.x*s,this._y=e.y*s,this._z=e.z*s,this._w=Math.cos(i),this._onChangeCallback(),this}setFromRotationMatrix(e){let t=e.elements,i=t[0],s=t[4],r=t[8],o=t[1],a=t[5],l=t[9],c=t[2],u=t[6],h=t[10],d=i+a+h;if(d>0){let f=.5/Math.sqrt(d+1);this._w=.25/f,this._x=(u-l)*f,this._y=(r-c)*f,this._z=(o-s)*f}else if(i>a&&i>h){let f=2*Math.sqrt(1+i-a-h);this._w=(u-l)/f,this._x=.25*f,this._y=(s+o)/f,this._z=(r+c)/f}else if(a>h){let f=2*Math.sqrt(1+a-i-h);this._w=(r-c)/f,this._x=(s+o)/f,this._y=.25*f,this._z=(l+u)/f}else{let f=2*Math.sqrt(1+h-i-a);this._w=(o-s)/f,this._x=(r+c)/f,this._y=(l+u)/f,this._z=.25*f}return this._onChangeCallback(),this}setFromUnitVectors(e,t){let i=e.dot(t)+1;return i<1e-8?(i=0,Math.abs(e.x)>Math.abs(e.z)?(this._x=-e.y,this._y=e.x,this._z=0,this._w=i):(this._x=0,this._y=-e.z,this._z=e.y,this._w=i)):(this._x=e.y*t.z-e.z*t.y,this._y=e.z*t.x-e.x*t.z,this._z=e.x*t.y-e.y*t.x,this._w=i),this.normalize()}angleTo(e){return 2*Math.acos(Math.abs(ut(this.dot(e),-1,1)))}rotateTowards(e,t){let i=this.angleTo(e);if(i===0)return this;let s=Math.min(1,t/i);return this.slerp(e,s),this}identity(){return this.set(0,0,0,1)}invert(){return this.conjugate()}conjugate(){return this._x*=-1,this._y*=-1,this._z*=-1,this._onChangeCallback(),this}dot(e){return this._x*e._x+this._y*e._y+this._z*e._z+this._w*e._w}lengthSq(){return this._x*this._x+this._y*this._y+this._z*this._z+this._w*this._w}length(){return Math.sqrt(this._x*this._x+this._y*this._y+this._z*this._z+this._w*this._w)}normalize(){let e=this.length();return e===0?(this._x=0,this._y=0,this._z=0,this._w=1):(e=1/e,this._x=this._x*e,this._y=this._y*e,this._z=this._z*e,this._w=this._w*e),this._onChangeCallback(),this}multiply(e){return this.multiplyQuaternions(this,e)}premultiply(e){return this.multiplyQuaternions(e,this)}multiplyQuaternions(e,t){let i=e._x,s=e._y,r=e._z,o=e._w,a=t._x,l=t._y,c=t._z,u=t._w;return this._x=i*u+o*a+s*c-r*l,this._y=s*u+o*l+r*a-i*c,this._z=r*u+o*c+i*l-s*a,this._w=o*u-i*a-s*l-r*c,this._onChangeCallback(),this}slerp(e,t){let i=e._x,s=e._y,r=e._z,o=e._w,a=this.dot(e);a<0&&(i=-i,s=-s,r=-r,o=-o,a=-a);let l=1-t;if(a<.9995){let c=Math.acos(a),u=Math.sin(c);l=Math.sin(l*c)/u,t=Math.sin(t*c)/u,this._x=this._x*l+i*t,this._y=this._y*l+s*t,this._z=this._z*l+r*t,this._w=this._w*l+o*t,this._onChangeCallback()}else this._x=this._x*l+i*t,this._y=this._y*l+s*t,this._z=this._z*l+r*t,this._w=this._w*l+o*t,this.normalize();return this}slerpQuaternions(e,t,i){return this.copy(e).slerp(t,i)}random(){let e=2*Math.PI*Math.random(),t=2*Math.PI*Math.random(),i=Math.random(),s=Math.sqrt(1-i),r=Math.sqrt(i);return this.set(s*Math.sin(e),s*Math.cos(e),r*Math.sin(t),r*Math.cos(t))}equals(e){return e._x===this._x&&e._y===this._y&&e._z===this._z&&e._w===this._w}fromArray(e,t=0){return this._x=e[t],this._y=e[t+1],this._z=e[t+2],this._w=e[t+3],this._onChangeCallback(),this}toArray(e=[],t=0){return e[t]=this._x,e[t+1]=this._y,e[t+2]=this._z,e[t+3]=this._w,e}fromBufferAttribute(e,t){return this._x=e.getX(t),this._y=e.getY(t),this._z=e.getZ(t),this._w=e.getW(t),this._onChangeCallback(),this}toJSON(){return this.toArray()}_onChange(e){return this._onChangeCallback=e,this}_onChangeCallback(){}*[Symbol.iterator](){yield this._x,yield this._y,yield this._z,yield this._w}},B=class{static{this.prototype.isVector3=!0}constructor(e=0,t=0,i=0){this.x=e,this.y=t,this.z=i}set(e,t,i){return i===void 0&&(i=this.z),this.x=e,this.y=t,this.z=i,this}setScalar(e){return this.x=e,this.y=e,this.z=e,this}setX(e){return this.x=e,this}setY(e){return this.y=e,this}setZ(e){return this.z=e,this}setComponent(e,t){switch(e){case 0:this.x=t;break;case 1:this.y=t;break;case 2:this.z=t;break;default:throw new Error("THREE.Vector3: index is out of range: "+e)}return this}getComponent(e){switch(e){case 0:return this.x;case 1:return this.y;case 2:return this.z;default:throw new Error("THREE.Vector3: index is out of range: "+e)}}clone(){return new this.constructor(this.x,this.y,this.z)}copy(e){return this.x=e.x,this.y=e.y,this.z=e.z,this}add(e){return this.x+=e.x,this.y+=e.y,this.z+=e.z,this}addScalar(e){return this.x+=e,this.y+=e,this.z+=e,this}addVectors(e,t){return this.x=e.x+t.x,this.y=e.y+t.y,this.z=e.z+t.z,this}addScaledVector(e,t){return this.x+=e.x*t,this.y+=e.y*t,this.z+=e.z*t,this}sub(e){return this.x-=e.x,this.y-=e.y,this.z-=e.z,this}subScalar(e){return this.x-=e,this.y-=e,this.z-=e,this}subVectors(e,t){return this.x=e.x-t.x,this.y=e.y-t.y,this.z=e.z-t.z,this}multiply(e){return this.x*=e.x,this.y*=e.y,this.z*=e.z,this}multiplyScalar(e){return this.x*=e,this.y*=e,this.z*=e,this}multiplyVectors(e,t){return this.x=e.x*t.x,this.y=e.y*t.y,this.z=e.z*t.z,this}applyEuler(e){return this.applyQuaternion(y_.setFromEuler(e))}applyAxisAngle(e,t){return this.applyQuaternion(y_.setFromAxisAngle(e,t))}applyMatrix3(e){let t=this.x,i=this.y,s=this.z,r=e.elements;return this.x=r[0]*t+r[3]*i+r[6]*s,this.y=r[1]*t+r[4]*i+r[7]*s,this.z=r[2]*t+r[5]*i+r[8]*s,this}applyNormalMatrix(e){return this.applyMatrix3(e).normalize()}applyMatrix4(e){let t=this.x,i=this.y,s=this.z,r=e.elements,o=1/(r[3]*t+r[7]*i+r[11]*s+r[15]);return this.x=(r[0]*t+r[4]*i+r[8]*s+r[12])*o,this.y=(r[1]*t+r[5]*i+r[9]*s+r[13])*o,this.z=(r[2]*t+r[6]*i+r[10]*s+r[14])*o,this}applyQuaternion(e){let t=this.x,i=this.y,s=this.z,r=e.x,o=e.y,a=e.z,l=e.w,c=2*(o*s-a*i),u=2*(a*t-r*s),h=2*(r*i-o*t);return this.x=t+l*c+o*h-a*u,this.y=i+l*u+a*c-r*h,this.z=s+l*h+r*u-o*c,this}project(e){return this.applyMatrix4(e.matrixWorldInverse).applyMatrix4(e.projectionMatrix)}unproject(e){return this.applyMatrix4(e.projectionMatrixInverse).applyMatrix4(e.matrixWorld)}transformDirection(e){let t=this.x,i=this.y,s=this.z,r=e.elements;return this.x=r[0]*t+r[4]*i+r[8]*s,this.y=r[1]*t+r[5]*i+r[9]*s,this.z=r[2]*t+r[6]*i+r[10]*s,this.normalize()}divide(e){return this.x/=e.x,this.y/=e.y,this.z/=e.z,this}divideScalar(e){return this.multiplyScalar(1/e)}min(e){return this.x=Math.min(this.x,e.x),this.y=Math.min(this.y,e.y),this.z=Math.min(this.z,e.z),this}max(e){return this.x=Math.max(this.x,e.x),this.y=Math.max(this.y,e.y),this.z=Math.max(this.z,e.z),this}clamp(e,t){return this.x=ut(this.x,e.x,t.x),this.y=ut(this.y,e.y,t.y),this.z=ut(this.z,e.z,t.z),this}clampScalar(e,t){return this.x=ut(this.x,e,t),this.y=ut(this.y,e,t),this.z=ut(this.z,e,t),this}clampLength(e,t){let i=this.length();return this.divideScalar(i||1).multiplyScalar(ut(i,e,t))}floor(){return this.x=Math.floor(this.x),this.y=Math.floor(this.y),this.z=Math.floor(this.z),this}ceil(){return this.x=Math.ceil(this.x),this.y=Math.ceil(this.y),this.z=Math.ceil(this.z),this}round(){return this.x=Math.round(this.x),this.y=Math.round(this.y),this.z=Math.round(this.z),this}roundToZero(){return this.x=Math.trunc(this.x),this.y=Math.trunc(this.y),this.z=Math.trunc(this.z),this}negate(){return this.x=-this.x,this.y=-this.y,this.z=-this.z,this}dot(e){return this.x*e.x+this.y*e.y+this.z*e.z}lengthSq(){return this.x*this.x+this.y*this.y+this.z*this.z}length(){return Math.sqrt(this.x*this.x+this.y*this.y+this.z*this.z)}manhattanLength(){return Math.abs(this.x)+Math.abs(this.y)+Math.abs(this.z)}normalize(){return this.divideScalar(this.length()||1)}setLength(e){return this.normalize().multiplyScalar(e)}lerp(e,t){return this.x+=(e.x-this.x)*t,this.y+=(e.y-this.y)*t,this.z+=(e.z-this.z)*t,this}lerpVectors(e,t,i){return this.x=e.x+(t.x-e.x)*i,this.y=e.y+(t.y-e.y)*i,this.z=e.z+(t.z-e.z)*i,this}cross(e){return this.crossVectors(this,e)}crossVectors(e,t){let i=e.x,s=e.y,r=e.z,o=t.x,a=t.y,l=t.z;return this.x=s*l-r*a,this.y=r*o-i*l,this.z=i*a-s*o,this}projectOnVector(e){let t=e.lengthSq();if(t===0)return this.set(0,0,0);let i=e.dot(this)/t;return this.copy(e).multiplyScalar(i)}projectOnPlane(e){return Cp.copy(this).projectOnVector(e),this.sub(Cp)}reflect(e){return this.sub(Cp.copy(e).multiplyScalar(2*this.dot(e)))}angleTo(e){let t=Math.sqrt(this.lengthSq()*e.lengthSq());if(t===0)return Math.PI/2;let i=this.dot(e)/t;return Math.acos(ut(i,-1,1))}distanceTo(e){return Math.sqrt(this.distanceToSquared(e))}distanceToSquared(e){let t=this.x-e.x,i=this.y-e.y,s=this.z-e.z;return t*t+i*i+s*s}manhattanDistanceTo(e){return Math.abs(this.x-e.x)+Math.abs(this.y-e.y)+Math.abs(this.z-e.z)}setFromSpherical(e){return this.setFromSphericalCoords(e.radius,e.phi,e.theta)}setFromSphericalCoords(e,t,i){let s=Math.sin(t)*e;return this.x=s*Math.sin(i),this.y=Math.cos(t)*e,this.z=s*Math.cos(i),this}setFromCylindrical(e){return this.setFromCylindricalCoords(e.radius,e.theta,e.y)}setFromCylindricalCoords(e,t,i){return this.x=e*Math.sin(t),this.y=i,this.z=e*Math.cos(t),this}setFromMatrixPosition(e){let t=e.elements;return this.x=t[12],this.y=t[13],this.z=t[14],this}setFromMatrixScale(e){let t=this.setFromMatrixColumn(e,0).length(),i=this.setFromMatrixColumn(e,1).length(),s=this.setFromMatrixColumn(e,2).length();return this.x=t,this.y=i,this.z=s,this}setFromMatrixColumn(e,t){return this.fromArray(e.elements,t*4)}setFromMatrix3Column(e,t){return this.fromArray(e.elements,t*3)}setFromEuler(e){return this.x=e._x,this.y=e._y,this.z=e._z,this}setFromColor(e){return this.x=e.r,this.y=e.g,this.z=e.b,this}equals(e){return e.x===this.x&&e.y===this.y&&e.z===this.z}fromArray(e,t=0){return this.x=e[t],this.y=e[t+1],this.z=e[t+2],this}toArray(e=[],t=0){return e[t]=this.x,e[t+1]=this.y,e[t+2]=this.z,e}fromBufferAttribute(e,t){return this.x=e.getX(t),this.y=e.getY(t),this.z=e.getZ(t),this}random(){return this.x=Math.random(),this.y=Math.random(),this.z=Math.random(),this}randomDirection(){let e=Math.random()*Math.PI*2,t=Math.random()*2-1,i=Math.sqrt(1-t*t);return this.x=i*Math.cos(e),this.y=t,this.z=i*Math.sin(e),this}*[Symbol.iterator](){yield this.x,yield this.y,yield this.z}},Cp=new B,y_=new rs,nt=class{static{this.prototype.isMatrix3=!0}constructor(e,t,i,s,r,o,a,l,c){this.elements=[1,0,0,0,1,0,0,0,1],e!==void 0&&this.set(e,t,i,s,r,o,a,l,c)}set(e,t,i,s,r,o,a,l,c){let u=this.elements;return u[0]=e,u[1]=s,u[2]=a,u[3]=t,u[4]=r,u[5]=l,u[6]=i,u[7]=o,u[8]=c,this}identity(){return this.set(1,0,0,0,1,0,0,0,1),this}copy(e){let t=this.elements,i=e.elements;return t[0]=i[0],t[1]=i[1],t[2]=i[2],t[3]=i[3],t[4]=i[4],t[5]=i[5],t[6]=i[6],t[7]=i[7],t[8]=i[8],this}extractBasis(e,t,i){return e.setFromMatrix3Column(this,0),t.setFromMatrix3Column(this,1),i.setFromMatrix3Column(this,2),this}setFromMatrix4(e){let t=e.elements;return this.set(t[0],t[4],t[8],t[1],t[5],t[9],t[2],t[6],t[10]),this}multiply(e){return this.multiplyMatrices(this,e)}premultiply(e){return this.multiplyMatrices(e,this)}multiplyMatrices(e,t){let i=e.elements,s=t.elements,r=this.elements,o=i[0],a=i[3],l=i[6],c=i[1],u=i[4],h=i[7],d=i[2],f=i[5],m=i[8],y=s[0],g=s[3],p=s[6],x=s[1],T=s[4],b=s[7],R=s[2],A=s[5],v=s[8];return r[0]=o*y+a*x+l*R,r[3]=o*g+a*T+l*A,r[6]=o*p+a*b+l*v,r[1]=c*y+u*x+h*R,r[4]=c*g+u*T+h*A,r[7]=c*p+u*b+h*v,r[2]=d*y+f*x+m*R,r[5]=d*g+f*T+m*A,r[8]=d*p+f*b+m*v,this}multiplyScalar(e){let t=this.elements;return t[0]*=e,t[3]*=e,t[6]*=e,t[1]*=e,t[4]*=e,t[7]*=e,t[2]*=e,t[5]*=e,t[8]*=e,this}determinant(){let e=this.elements,t=e[0],i=e[1],s=e[2],r=e[3],o=e[4],a=e[5],l=e[6],c=e[7],u=e[8];return t*o*u-t*a*c-i*r*u+i*a*l+s*r*c-s*o*l}invert(){let e=this.elements,t=e[0],i=e[1],s=e[2],r=e[3],o=e[4],a=e[5],l=e[6],c=e[7],u=e[8],h=u*o-a*c,d=a*l-u*r,f=c*r-o*l,m=t*h+i*d+s*f;if(m===0)return this.set(0,0,0,0,0,0,0,0,0);let y=1/m;return e[0]=h*y,e[1]=(s*c-u*i)*y,e[2]=(a*i-s*o)*y,e[3]=d*y,e[4]=(u*t-s*l)*y,e[5]=(s*r-a*t)*y,e[6]=f*y,e[7]=(i*l-c*t)*y,e[8]=(o*t-i*r)*y,this}transpose(){let e,t=this.elements;return e=t[1],t[1]=t[3],t[3]=e,e=t[2],t[2]=t[6],t[6]=e,e=t[5],t[5]=t[7],t[7]=e,this}getNormalMatrix(e){return this.setFromMatrix4(e).invert().transpose()}transposeIntoArray(e){let t=this.elements;return e[0]=t[0],e[1]=t[3],e[2]=t[6],e[3]=t[1],e[4]=t[4],e[5]=t[7],e[6]=t[2],e[7]=t[5],e[8]=t[8],this}setUvTransform(e,t,i,s,r,o,a){let l=Math.cos(r),c=Math.sin(r);return this.set(i*l,i*c,-i*(l*o+c*a)+o+e,-s*c,s*l,-s*(-c*o+l*a)+a+t,0,0,1),this}scale(e,t){return lc("Matrix3: .scale() is deprecated. Use .makeScale() instead."),this.premultiply(Rp.makeScale(e,t)),this}rotate(e){return lc("Matrix3: .rotate() is deprecated. Use .makeRotation() instead."),this.premultiply(Rp.makeRotation(-e)),this}translate(e,t){return lc("Matrix3: .translate() is deprecated. Use .makeTranslation() instead."),this.premultiply(Rp.makeTranslation(e,t)),this}makeTranslation(e,t){return e.isVector2?this.set(1,0,e.x,0,1,e.y,0,0,1):this.set(1,0,e,0,1,t,0,0,1),this}makeRotation(e){let t=Math.cos(e),i=Math.sin(e);return this.set(t,-i,0,i,t,0,0,0,1),this}makeScale(e,t){return this.set(e,0,0,0,t,0,0,0,1),this}equals(e){let t=this.elements,i=e.elements;for(let s=0;s<9;s++)if(t[s]!==i[s])return!1;return!0}fromArray(e,t=0){for(let i=0;i<9;i++)this.elements[i]=e[i+t];return this}toArray(e=[],t=0){let i=this.elements;return e[t]=i[0],e[t+1]=i[1],e[t+2]=i[2],e[t+3]=i[3],e[t+4]=i[4],e[t+5]=i[5],e[t+6]=i[6],e[t+7]=i[7],e[t+8]=i[8],e}clone(){return new this.constructor().fromArray(this.elements)}},Rp=new nt,x_=new nt().set(.4123908,.3575843,.1804808,.212639,.7151687,.0721923,.0193308,.1191948,.9505322),b_=new nt().set(3.2409699,-1.5373832,-.4986108,-.9692436,1.8759675,.0415551,.0556301,-.203977,1.0569715);function ow(){let n={enabled:!0,workingColorSpace:Oo,spaces:{},convert:function(s,r,o){return this.enabled===!1||r===o||!r||!o||(this.spaces[r].transfer===Pt&&(s.r=_r(s.r),s.g=_r(s.g),s.b=_r(s.b)),this.spaces[r].primaries!==this.spaces[o].primaries&&(s.applyMatrix3(this.spaces[r].toXYZ),s.applyMatrix3(this.spaces[o].fromXYZ)),this.spaces[o].transfer===Pt&&(s.r=Wa(s.r),s.g=Wa(s.g),s.b=Wa(s.b))),s},workingToColorSpace:function(s,r){return this.convert(s,this.workingColorSpace,r)},colorSpaceToWorking:function(s,r){return this.convert(s,r,this.workingColorSpace)},getPrimaries:function(s){return this.spaces[s].primaries},getTransfer:function(s){return s===Mr?dc:this.spaces[s].transfer},getToneMappingMode:function(s){return this.spaces[s].outputColorSpaceConfig.toneMappingMode||"standard"},getLuminanceCoefficients:function(s,r=this.workingColorSpace){return s.fromArray(this.spaces[r].luminanceCoefficients)},define:function(s){Object.assign(this.spaces,s)},_getMatrix:function(s,r,o){return s.copy(this.spaces[o].fromXYZ).multiply(this.spaces[r].toXYZ)},_getDrawingBufferColorSpace:function(s){return this.spaces[s].outputColorSpaceConfig.drawingBufferColorSpace},_getUnpackColorSpace:function(s=this.workingColorSpace){return this.spaces[s].workingColorSpaceConfig.unpackColorSpace}},e=[.64,.33,.3,.6,.15,.06],t=[.2126,.7152,.0722],i=[.3127,.329];return n.define({[Oo]:{primaries:e,whitePoint:i,transfer:dc,toXYZ:x_,fromXYZ:b_,luminanceCoefficients:t,workingColorSpaceConfig:{unpackColorSpace:Xi},outputColorSpaceConfig:{drawingBufferColorSpace:Xi}},[Xi]:{primaries:e,whitePoint:i,transfer:Pt,toXYZ:x_,fromXYZ:b_,luminanceCoefficients:t,outputColorSpaceConfig:{drawingBufferColorSpace:Xi}}}),n}var vt=ow();function _r(n){return n<.04045?n*.0773993808:Math.pow(n*.9478672986+.0521327014,2.4)}function Wa(n){return n<.0031308?n*12.92:1.055*Math.pow(n,.41666)-.055}var Ra,wh=class{static getDataURL(e,t="image/png"){if(/^data:/i.test(e.src)||typeof HTMLCanvasElement>"u")return e.src;let i;if(e instanceof HTMLCanvasElement)i=e;else{Ra===void 0&&(Ra=fc("canvas")),Ra.width=e.width,Ra.height=e.height;let s=Ra.getContext("2d");e instanceof ImageData?s.putImageData(e,0,0):s.drawImage(e,0,0,e.width,e.height),i=Ra}return i.toDataURL(t)}static sRGBToLinear(e){if(typeof HTMLImageElement<"u"&&e instanceof HTMLImageElement||typeof HTMLCanvasElement<"u"&&e instanceof HTMLCanvasElement||typeof ImageBitmap<"u"&&e instanceof ImageBitmap){let t=fc("canvas");t.width=e.width,t.height=e.height;let i=t.getContext("2d");i.drawImage(e,0,0,e.width,e.height);let s=i.getImageData(0,0,e.width,e.height),r=s.data;for(let o=0;o<r.length;o++)r[o]=_r(r[o]/255)*255;return i.putImageData(s,0,0),t}else if(e.data){let t=e.data.slice(0);for(let i=0;i<t.length;i++)t instanceof Uint8Array||t instanceof Uint8ClampedArray?t[i]=Math.floor(_r(t[i]/255)*255):t[i]=_r(t[i]);return{data:t,width:e.width,height:e.height}}else return Ze("ImageUtils.sRGBToLinear(): Unsupported image type. No color space conversion applied."),e}},aw=0,Ja=class{constructor(e=null){this.isTextureSource=!0,Object.defineProperty(this,"id",{value:aw++}),this.uuid=io(),this.data=e,this.dataReady=!0,this.version=0}getSize(e){let t=this.data;return typeof HTMLVideoElement<"u"&&t instanceof HTMLVideoElement?e.set(t.videoWidth,t.videoHeight,0):typeof VideoFrame<"u"&&t instanceof VideoFrame?e.set(t.displayWidth,t.displayHeight,0):t!==null?e.set(t.width||0,t.height||0,t.depth||0):e.set(0,0,0),e}set needsUpdate(e){e===!0&&this.version++}toJSON(e){let t=e===void 0||typeof e=="string";if(!t&&e.images[this.uuid]!==void 0)return e.images[this.uuid];let i={uuid:this.uuid,url:""},s=this.data;if(s!==null){let r;if(Array.isArray(s)){r=[];for(let o=0,a=s.length;o<a;o++)s[o].isDataTexture?r.push(Pp(s[o].image)):r.push(Pp(s[o]))}else r=Pp(s);i.url=r}return t||(e.images[this.uuid]=i),i}};function Pp(n){return typeof HTMLImageElement<"u"&&n instanceof HTMLImageElement||typeof HTMLCanvasElement<"u"&&n instanceof HTMLCanvasElement||typeof ImageBitmap<"u"&&n instanceof ImageBitmap?wh.getDataURL(n):n.data?{data:Array.from(n.data),width:n.width,height:n.height,type:n.data.constructor.name}:(Ze("Texture: Unable to serialize Texture."),{})}var lw=0,Ip=new B,Ui=class n extends Hs{constructor(e=n.DEFAULT_IMAGE,t=n.DEFAULT_MAPPING,i=Vs,s=Vs,r=Ti,o=br,a=Yi,l=di,c=n.DEFAULT_ANISOTROPY,u=Mr){super(),this.isTexture=!0,Object.defineProperty(this,"id",{value:lw++}),this.uuid=io(),this.name="",this.source=new Ja(e),this.mipmaps=[],this.mapping=t,this.channel=0,this.wrapS=i,this.wrapT=s,this.magFilter=r,this.minFilter=o,this.anisotropy=c,this.format=a,this.internalFormat=null,this.type=l,this.offset=new at(0,0),this.repeat=new at(1,1),this.center=new at(0,0),this.rotation=0,this.matrixAutoUpdate=!0,this.matrix=new nt,this.generateMipmaps=!0,this.mipmapsAutoUpdate=!0,this.premultiplyAlpha=!1,this.flipY=!0,this.unpackAlignment=4,this.colorSpace=u,this.userData={},this.updateRanges=[],this.version=0,this.onUpdate=null,this.renderTarget=null,this.isRenderTargetTexture=!1,this.isArrayTexture=!!(e&&e.depth&&e.depth>1),this.pmremVersion=0,this.isPMREMTexture=!1,this.normalized=!1}get width(){return this.source.getSize(Ip).x}get height(){return this.source.getSize(Ip).y}get depth(){return this.source.getSize(Ip).z}get image(){return this.source.data}set image(e){this.source.data=e}updateMatrix(){this.matrix.setUvTransform(this.offset.x,this.offset.y,this.repeat.x,this.repeat.y,this.rotation,this.center.x,this.center.y)}addUpdateRange(e,t){this.updateRanges.push({start:e,count:t})}clearUpdateRanges(){this.updateRanges.length=0}clone(){return new this.constructor().copy(this)}copy(e){return this.name=e.name,this.source=e.source,this.mipmaps=e.mipmaps.slice(0),this.mapping=e.mapping,this.channel=e.channel,this.wrapS=e.wrapS,this.wrapT=e.wrapT,this.magFilter=e.magFilter,this.minFilter=e.minFilter,this.anisotropy=e.anisotropy,this.format=e.format,this.internalFormat=e.internalFormat,this.type=e.type,this.normalized=e.normalized,this.offset.copy(e.offset),this.repeat.copy(e.repeat),this.center.copy(e.center),this.rotation=e.rotation,this.matrixAutoUpdate=e.matrixAutoUpdate,this.matrix.copy(e.matrix),this.generateMipmaps=e.generateMipmaps,this.mipmapsAutoUpdate=e.mipmapsAutoUpdate,this.premultiplyAlpha=e.premultiplyAlpha,this.flipY=e.flipY,this.unpackAlignment=e.unpackAlignment,this.colorSpace=e.colorSpace,this.renderTarget=e.renderTarget,this.isRenderTargetTexture=e.isRenderTargetTexture,this.isPMREMTexture=e.isPMREMTexture,this.isArrayTexture=e.isArrayTexture,this.userData=JSON.parse(JSON.stringify(e.userData)),this.needsUpdate=!0,this}setValues(e){for(let t in e){let i=e[t];if(i===void 0){Ze(`Texture.setValues(): parameter '${t}' has value of undefined.`);continue}let s=this[t];if(s===void 0){Ze(`Texture.setValues(): property '${t}' does not exist.`);continue}s&&i&&s.isVector2&&i.isVector2||s&&i&&s.isVector3&&i.isVector3||s&&i&&s.isMatrix3&&i.isMatrix3?s.copy(i):this[t]=i}}toJSON(e){let t=e===void 0||typeof e=="string";if(!t&&e.textures[this.uuid]!==void 0)return e.textures[this.uuid];let i={metadata:{version:4.7,type:"Texture",generator:"Texture.toJSON"},uuid:this.uuid,name:this.name,image:this.source.toJSON(e).uuid,mapping:this.mapping,channel:this.channel,repeat:[this.repeat.x,this.repeat.y],offset:[this.offset.x,this.offset.y],center:[this.center.x,this.center.y],rotation:this.rotation,wrap:[this.wrapS,this.wrapT],format:this.format,internalFormat:this.internalFormat,type:this.type,normalized:this.normalized,colorSpace:this.colorSpace,minFilter:this.minFilter,magFilter:this.magFilter,anisotropy:this.anisotropy,flipY:this.flipY,generateMipmaps:this.generateMipmaps,mipmapsAutoUpdate:this.mipmapsAutoUpdate,premultiplyAlpha:this.premultiplyAlpha,unpackAlignment:this.unpackAlignment};return Object.keys(this.userData).length>0&&(i.userData=this.userData),t||(e.textures[this.uuid]=i),i}dispose(){this.dispatchEvent({type:"dispose"})}transformUv(e){if(this.mapping!==gm)return e;if(e.applyMatrix3(this.matrix),e.x<0||e.x>1)switch(this.wrapS){case bh:e.x=e.x-Math.floor(e.x);break;case Vs:e.x=e.x<0?0:1;break;case Sh:Math.abs(Math.floor(e.x)%2)===1?e.x=Math.ceil(e.x)-e.x:e.x=e.x-Math.floor(e.x);break}if(e.y<0||e.y>1)switch(this.wrapT){case bh:e.y=e.y-Math.floor(e.y);break;case Vs:e.y=e.y<0?0:1;break;case Sh:Math.abs(Math.floor(e.y)%2)===1?e.y=Math.ceil(e.y)-e.y:e.y=e.y-Math.floor(e.y);break}return this.flipY&&(e.y=1-e.y),e}set needsUpdate(e){e===!0&&(this.version++,this.source.needsUpdate=!0)}set needsPMREMUpdate(e){e===!0&&this.pmremVersion++}};Ui.DEFAULT_IMAGE=null;Ui.DEFAULT_MAPPING=gm;Ui.DEFAULT_ANISOTROPY=1;var It=class{static{this.prototype.isVector4=!0}constructor(e=0,t=0,i=0,s=1){this.x=e,this.y=t,this.z=i,this.w=s}get width(){return this.z}set width(e){this.z=e}get height(){return this.w}set height(e){this.w=e}set(e,t,i,s){return this.x=e,this.y=t,this.z=i,this.w=s,this}setScalar(e){return this.x=e,this.y=e,this.z=e,this.w=e,this}setX(e){return this.x=e,this}setY(e){return this.y=e,this}setZ(e){return this.z=e,this}setW(e){return this.w=e,this}setComponent(e,t){switch(e){case 0:this.x=t;break;case 1:this.y=t;break;case 2:this.z=t;break;case 3:this.w=t;break;default:throw new Error("THREE.Vector4: index is out of range: "+e)}return this}getComponent(e){switch(e){case 0:return this.x;case 1:return this.y;case 2:return this.z;case 3:return this.w;default:throw new Error("THREE.Vector4: index is out of range: "+e)}}clone(){return new this.constructor(this.x,this.y,this.z,this.w)}copy(e){return this.x=e.x,this.y=e.y,this.z=e.z,this.w=e.w!==void 0?e.w:1,this}add(e){return this.x+=e.x,this.y+=e.y,this.z+=e.z,this.w+=e.w,this}addScalar(e){return this.x+=e,this.y+=e,this.z+=e,this.w+=e,this}addVectors(e,t){return this.x=e.x+t.x,this.y=e.y+t.y,this.z=e.z+t.z,this.w=e.w+t.w,this}addScaledVector(e,t){return this.x+=e.x*t,this.y+=e.y*t,this.z+=e.z*t,this.w+=e.w*t,this}sub(e){return this.x-=e.x,this.y-=e.y,this.z-=e.z,this.w-=e.w,this}subScalar(e){return this.x-=e,this.y-=e,this.z-=e,this.w-=e,this}subVectors(e,t){return this.x=e.x-t.x,this.y=e.y-t.y,this.z=e.z-t.z,this.w=e.w-t.w,this}multiply(e){return this.x*=e.x,this.y*=e.y,this.z*=e.z,this.w*=e.w,this}multiplyScalar(e){return this.x*=e,this.y*=e,this.z*=e,this.w*=e,this}applyMatrix4(e){let t=this.x,i=this.y,s=this.z,r=this.w,o=e.elements;return this.x=o[0]*t+o[4]*i+o[8]*s+o[12]*r,this.y=o[1]*t+o[5]*i+o[9]*s+o[13]*r,this.z=o[2]*t+o[6]*i+o[10]*s+o[14]*r,this.w=o[3]*t+o[7]*i+o[11]*s+o[15]*r,this}divide(e){return this.x/=e.x,this.y/=e.y,this.z/=e.z,this.w/=e.w,this}divideScalar(e){return this.multiplyScalar(1/e)}setAxisAngleFromQuaternion(e){this.w=2*Math.acos(e.w);let t=Math.sqrt(1-e.w*e.w);return t<1e-4?(this.x=1,this.y=0,this.z=0):(this.x=e.x/t,this.y=e.y/t,this.z=e.z/t),this}setAxisAngleFromRotationMatrix(e){let t,i,s,r,l=e.elements,c=l[0],u=l[4],h=l[8],d=l[1],f=l[5],m=l[9],y=l[2],g=l[6],p=l[10];if(Math.abs(u-d)<.01&&Math.abs(h-y)<.01&&Math.abs(m-g)<.01){if(Math.abs(u+d)<.1&&Math.abs(h+y)<.1&&Math.abs(m+g)<.1&&Math.abs(c+f+p-3)<.1)return this.set(1,0,0,0),this;t=Math.PI;let T=(c+1)/2,b=(f+1)/2,R=(p+1)/2,A=(u+d)/4,v=(h+y)/4,E=(m+g)/4;return T>b&&T>R?T<.01?(i=0,s=.707106781,r=.707106781):(i=Math.sqrt(T),s=A/i,r=v/i):b>R?b<.01?(i=.707106781,s=0,r=.707106781):(s=Math.sqrt(b),i=A/s,r=E/s):R<.01?(i=.707106781,s=.707106781,r=0):(r=Math.sqrt(R),i=v/r,s=E/r),this.set(i,s,r,t),this}let x=Math.sqrt((g-m)*(g-m)+(h-y)*(h-y)+(d-u)*(d-u));return Math.abs(x)<.001&&(x=1),this.x=(g-m)/x,this.y=(h-y)/x,this.z=(d-u)/x,this.w=Math.acos((c+f+p-1)/2),this}setFromMatrixPosition(e){let t=e.elements;return this.x=t[12],this.y=t[13],this.z=t[14],this.w=t[15],this}min(e){return this.x=Math.min(this.x,e.x),this.y=Math.min(this.y,e.y),this.z=Math.min(this.z,e.z),this.w=Math.min(this.w,e.w),this}max(e){return this.x=Math.max(this.x,e.x),this.y=Math.max(this.y,e.y),this.z=Math.max(this.z,e.z),this.w=Math.max(this.w,e.w),this}clamp(e,t){return this.x=ut(this.x,e.x,t.x),this.y=ut(this.y,e.y,t.y),this.z=ut(this.z,e.z,t.z),this.w=ut(this.w,e.w,t.w),this}clampScalar(e,t){return this.x=ut(this.x,e,t),this.y=ut(this.y,e,t),this.z=ut(this.z,e,t),this.w=ut(this.w,e,t),this}clampLength(e,t){let i=this.length();return this.divideScalar(i||1).multiplyScalar(ut(i,e,t))}floor(){return this.x=Math.floor(this.x),this.y=Math.floor(this.y),this.z=Math.floor(this.z),this.w=Math.floor(this.w),this}ceil(){return this.x=Math.ceil(this.x),this.y=Math.ceil(this.y),this.z=Math.ceil(this.z),this.w=Math.ceil(this.w),this}round(){return this.x=Math.round(this.x),this.y=Math.round(this.y),this.z=Math.round(this.z),this.w=Math.round(this.w),this}roundToZero(){return this.x=Math.trunc(this.x),this.y=Math.trunc(this.y),this.z=Math.trunc(this.z),this.w=Math.trunc(this.w),this}negate(){return this.x=-this.x,this.y=-this.y,this.z=-this.z,this.w=-this.w,this}dot(e){return this.x*e.x+this.y*e.y+this.z*e.z+this.w*e.w}lengthSq(){return this.x*this.x+this.y*this.y+this.z*this.z+this.w*this.w}length(){return Math.sqrt(this.x*this.x+this.y*this.y+this.z*this.z+this.w*this.w)}manhattanLength(){return Math.abs(this.x)+Math.abs(this.y)+Math.abs(this.z)+Math.abs(this.w)}normalize(){return this.divideScalar(this.length()||1)}setLength(e){return this.normalize().multiplyScalar(e)}lerp(e,t){return this.x+=(e.x-this.x)*t,this.y+=(e.y-this.y)*t,this.z+=(e.z-this.z)*t,this.w+=(e.w-this.w)*t,this}lerpVectors(e,t,i){return this.x=e.x+(t.x-e.x)*i,this.y=e.y+(t.y-e.y)*i,this.z=e.z+(t.z-e.z)*i,this.w=e.w+(t.w-e.w)*i,this}equals(e){return e.x===this.x&&e.y===this.y&&e.z===this.z&&e.w===this.w}fromArray(e,t=0){return this.x=e[t],this.y=e[t+1],this.z=e[t+2],this.w=e[t+3],this}toArray(e=[],t=0){return e[t]=this.x,e[t+1]=this.y,e[t+2]=this.z,e[t+3]=this.w,e}fromBufferAttribute(e,t){return this.x=e.getX(t),this.y=e.getY(t),this.z=e.getZ(t),this.w=e.getW(t),this}random(){return this.x=Math.random(),this.y=Math.random(),this.z=Math.random(),this.w=Math.random(),this}*[Symbol.iterator](){yield this.x,yield this.y,yield this.z,yield this.w}},Eh=class extends Hs{constructor(e=1,t=1,i={}){super(),i=Object.assign({generateMipmaps:!1,internalFormat:null,minFilter:Ti,depthBuffer:!0,stencilBuffer:!1,resolveColorBuffer:!0,resolveDepthBuffer:!0,resolveStencilBuffer:!0,storeMultisampledColorBuffer:!0,storeMultisampledDepthBuffer:!0,storeMultisampledStencilBuffer:!0,depthTexture:null,samples:0,count:1,depth:1,multiview:!1,useArrayDepthTexture:!1},i),this.isRenderTarget=!0,this.width=e,this.height=t,this.depth=i.depth,this.scissor=new It(0,0,e,t),this.scissorTest=!1,this.viewport=new It(0,0,e,t),this.textures=[];let s=i.count;for(let r=0;r<s;r++)this.textures[r]=new Ui({width:e,height:t,depth:i.depth}),this.textures[r].isRenderTargetTexture=!0,this.textures[r].renderTarget=this;this._setTextureOptions(i),this.depthBuffer=i.depthBuffer,this.stencilBuffer=i.stencilBuffer,this.resolveColorBuffer=i.resolveColorBuffer,this.resolveDepthBuffer=i.resolveDepthBuffer,this.resolveStencilBuffer=i.resolveStencilBuffer,this.storeMultisampledColorBuffer=i.storeMultisampledColorBuffer,this.storeMultisampledDepthBuffer=i.storeMultisampledDepthBuffer,this.storeMultisampledStencilBuffer=i.storeMultisampledStencilBuffer,this._depthTexture=null,this.depthTexture=i.depthTexture,this.samples=i.samples,this.multiview=i.multiview,this.useArrayDepthTexture=i.useArrayDepthTexture}_setTextureOptions(e={}){let t={minFilter:Ti,generateMipmaps:!1,flipY:!1,internalFormat:null};e.mapping!==void 0&&(t.mapping=e.mapping),e.wrapS!==void 0&&(t.wrapS=e.wrapS),e.wrapT!==void 0&&(t.wrapT=e.wrapT),e.wrapR!==void 0&&(t.wrapR=e.wrapR),e.magFilter!==void 0&&(t.magFilter=e.magFilter),e.minFilter!==void 0&&(t.minFilter=e.minFilter),e.format!==void 0&&(t.format=e.format),e.type!==void 0&&(t.type=e.type),e.anisotropy!==void 0&&(t.anisotropy=e.anisotropy),e.colorSpace!==void 0&&(t.colorSpace=e.colorSpace),e.flipY!==void 0&&(t.flipY=e.flipY),e.generateMipmaps!==void 0&&(t.generateMipmaps=e.generateMipmaps),e.mipmapsAutoUpdate!==void 0&&(t.mipmapsAutoUpdate=e.mipmapsAutoUpdate),e.internalFormat!==void 0&&(t.internalFormat=e.internalFormat);for(let i=0;i<this.textures.length;i++)this.textures[i].setValues(t)}get texture(){return this.textures[0]}set texture(e){this.textures[0]=e}set depthTexture(e){this._depthTexture!==null&&this._depthTexture.renderTarget===this&&(this._depthTexture.renderTarget=null),e!==null&&e.renderTarget===null&&(e.renderTarget=this),this._depthTexture=e}get depthTexture(){return this._depthTexture}setSize(e,t,i=1){if(this.width!==e||this.height!==t||this.depth!==i){this.width=e,this.height=t,this.depth=i;for(let s=0,r=this.textures.length;s<r;s++)this.textures[s].image.width=e,this.textures[s].image.height=t,this.textures[s].image.depth=i,this.textures[s].isData3DTexture!==!0&&(this.textures[s].isArrayTexture=this.textures[s].image.depth>1);this.dispose()}this.viewport.set(0,0,e,t),this.scissor.set(0,0,e,t)}clone(){return new this.constructor().copy(this)}copy(e){this.width=e.width,this.height=e.height,this.depth=e.depth,this.scissor.copy(e.scissor),this.scissorTest=e.scissorTest,this.viewport.copy(e.viewport),this.textures.length=0;for(let t=0,i=e.textures.length;t<i;t++){this.textures[t]=e.textures[t].clone(),this.textures[t].isRenderTargetTexture=!0,this.textures[t].renderTarget=this;let s=Object.assign({},e.textures[t].image);this.textures[t].source=new Ja(s)}if(this.depthBuffer=e.depthBuffer,this.stencilBuffer=e.stencilBuffer,this.resolveColorBuffer=e.resolveColorBuffer,this.resolveDepthBuffer=e.resolveDepthBuffer,this.resolveStencilBuffer=e.resolveStencilBuffer,this.storeMultisampledColorBuffer=e.storeMultisampledColorBuffer,this.storeMultisampledDepthBuffer=e.storeMultisampledDepthBuffer,this.storeMultisampledStencilBuffer=e.storeMultisampledStencilBuffer,e.depthTexture!==null)if(e.depthTexture.renderTarget===e){let t=e.depthTexture.clone();t.renderTarget=null,this.depthTexture=t}else this.depthTexture=e.depthTexture;else this.depthTexture=null;return this.samples=e.samples,this.multiview=e.multiview,this.useArrayDepthTexture=e.useArrayDepthTexture,this}dispose(){this.dispatchEvent({type:"dispose"})}},Ai=class extends Eh{constructor(e=1,t=1,i={}){super(e,t,i),this.isWebGLRenderTarget=!0}},mc=class extends Ui{constructor(e=null,t=1,i=1,s=1){super(null),this.isDataArrayTexture=!0,this.image={data:e,width:t,height:i,depth:s},this.magFilter=Rn,this.minFilter=Rn,this.wrapR=Vs,this.generateMipmaps=!1,this.flipY=!1,this.unpackAlignment=1,this.layerUpdates=new Set}copy(e){return super.copy(e),this.wrapR=e.wrapR,this}addLayerUpdate(e){this.layerUpdates.add(e)}clearLayerUpdates(){this.layerUpdates.clear()}};var Th=class extends Ui{constructor(e=null,t=1,i=1,s=1){super(null),this.isData3DTexture=!0,this.image={data:e,width:t,height:i,depth:s},this.magFilter=Rn,this.minFilter=Rn,this.wrapR=Vs,this.generateMipmaps=!1,this.flipY=!1,this.unpackAlignment=1}copy(e){return super.copy(e),this.wrapR=e.wrapR,this}};var ht=class n{static{this.prototype.isMatrix4=!0}constructor(e,t,i,s,r,o,a,l,c,u,h,d,f,m,y,g){this.elements=[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1],e!==void 0&&this.set(e,t,i,s,r,o,a,l,c,u,h,d,f,m,y,g)}set(e,t,i,s,r,o,a,l,c,u,h,d,f,m,y,g){let p=this.elements;return p[0]=e,p[4]=t,p[8]=i,p[12]=s,p[1]=r,p[5]=o,p[9]=a,p[13]=l,p[2]=c,p[6]=u,p[10]=h,p[14]=d,p[3]=f,p[7]=m,p[11]=y,p[15]=g,this}identity(){return this.set(1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1),this}clone(){return new n().fromArray(this.elements)}copy(e){let t=this.elements,i=e.elements;return t[0]=i[0],t[1]=i[1],t[2]=i[2],t[3]=i[3],t[4]=i[4],t[5]=i[5],t[6]=i[6],t[7]=i[7],t[8]=i[8],t[9]=i[9],t[10]=i[10],t[11]=i[11],t[12]=i[12],t[13]=i[13],t[14]=i[14],t[15]=i[15],this}copyPosition(e){let t=this.elements,i=e.elements;return t[12]=i[12],t[13]=i[13],t[14]=i[14],this}setFromMatrix3(e){let t=e.elements;return this.set(t[0],t[3],t[6],0,t[1],t[4],t[7],0,t[2],t[5],t[8],0,0,0,0,1),this}extractBasis(e,t,i){return this.determinantAffine()===0?(e.set(1,0,0),t.set(0,1,0),i.set(0,0,1),this):(e.setFromMatrixColumn(this,0),t.setFromMatrixColumn(this,1),i.setFromMatrixColumn(this,2),this)}makeBasis(e,t,i){return this.set(e.x,t.x,i.x,0,e.y,t.y,i.y,0,e.z,t.z,i.z,0,0,0,0,1),this}extractRotation(e){if(e.determinantAffine()===0)return this.identity();let t=this.elements,i=e.elements,s=1/Pa.setFromMatrixColumn(e,0).length(),r=1/Pa.setFromMatrixColumn(e,1).length(),o=1/Pa.setFromMatrixColumn(e,2).length();return t[0]=i[0]*s,t[1]=i[1]*s,t[2]=i[2]*s,t[3]=0,t[4]=i[4]*r,t[5]=i[5]*r,t[6]=i[6]*r,t[7]=0,t[8]=i[8]*o,t[9]=i[9]*o,t[10]=i[10]*o,t[11]=0,t[12]=0,t[13]=0,t[14]=0,t[15]=1,this}makeRotationFromEuler(e){let t=this.elements,i=e.x,s=e.y,r=e.z,o=Math.cos(i),a=Math.sin(i),l=Math.cos(s),c=Math.sin(s),u=Math.cos(r),h=Math.sin(r);if(e.order==="XYZ"){let d=o*u,f=o*h,m=a*u,y=a*h;t[0]=l*u,t[4]=-l*h,t[8]=c,t[1]=f+m*c,t[5]=d-y*c,t[9]=-a*l,t[2]=y-d*c,t[6]=m+f*c,t[10]=o*l}else if(e.order==="YXZ"){let d=l*u,f=l*h,m=c*u,y=c*h;t[0]=d+y*a,t[4]=m*a-f,t[8]=o*c,t[1]=o*h,t[5]=o*u,t[9]=-a,t[2]=f*a-m,t[6]=y+d*a,t[10]=o*l}else if(e.order==="ZXY"){let d=l*u,f=l*h,m=c*u,y=c*h;t[0]=d-y*a,t[4]=-o*h,t[8]=m+f*a,t[1]=f+m*a,t[5]=o*u,t[9]=y-d*a,t[2]=-o*c,t[6]=a,t[10]=o*l}else if(e.order==="ZYX"){let d=o*u,f=o*h,m=a*u,y=a*h;t[0]=l*u,t[4]=m*c-f,t[8]=d*c+y,t[1]=l*h,t[5]=y*c+d,t[9]=f*c-m,t[2]=-c,t[6]=a*l,t[10]=o*l}else if(e.order==="YZX"){let d=o*l,f=o*c,m=a*l,y=a*c;t[0]=l*u,t[4]=y-d*h,t[8]=m*h+f,t[1]=h,t[5]=o*u,t[9]=-a*u,t[2]=-c*u,t[6]=f*h+m,t[10]=d-y*h}else if(e.order==="XZY"){let d=o*l,f=o*c,m=a*l,y=a*c;t[0]=l*u,t[4]=-h,t[8]=c*u,t[1]=d*h+y,t[5]=o*u,t[9]=f*h-m,t[2]=m*h-f,t[6]=a*u,t[10]=y*h+d}return t[3]=0,t[7]=0,t[11]=0,t[12]=0,t[13]=0,t[14]=0,t[15]=1,this}makeRotationFromQuaternion(e){return this.compose(cw,e,uw)}lookAt(e,t,i){let s=this.elements;return Gi.subVectors(e,t),Gi.lengthSq()===0&&(Gi.z=1),Gi.normalize(),Wr.crossVectors(i,Gi),Wr.lengthSq()===0&&(Math.abs(i.z)===1?Gi.x+=1e-4:Gi.z+=1e-4,Gi.normalize(),Wr.crossVectors(i,Gi)),Wr.normalize(),$u.crossVectors(Gi,Wr),s[0]=Wr.x,s[4]=$u.x,s[8]=Gi.x,s[1]=Wr.y,s[5]=$u.y,s[9]=Gi.y,s[2]=Wr.z,s[6]=$u.z,s[10]=Gi.z,this}multiply(e){return this.multiplyMatrices(this,e)}premultiply(e){return this.multiplyMatrices(e,this)}multiplyMatrices(e,t){let i=e.elements,s=t.elements,r=this.elements,o=i[0],a=i[4],l=i[8],c=i[12],u=i[1],h=i[5],d=i[9],f=i[13],m=i[2],y=i[6],g=i[10],p=i[14],x=i[3],T=i[7],b=i[11],R=i[15],A=s[0],v=s[4],E=s[8],k=s[12],U=s[1],I=s[5],z=s[9],H=s[13],N=s[2],G=s[6],Y=s[10],W=s[14],ce=s[3],J=s[7],Q=s[11],se=s[15];return r[0]=o*A+a*U+l*N+c*ce,r[4]=o*v+a*I+l*G+c*J,r[8]=o*E+a*z+l*Y+c*Q,r[12]=o*k+a*H+l*W+c*se,r[1]=u*A+h*U+d*N+f*ce,r[5]=u*v+h*I+d*G+f*J,r[9]=u*E+h*z+d*Y+f*Q,r[13]=u*k+h*H+d*W+f*se,r[2]=m*A+y*U+g*N+p*ce,r[6]=m*v+y*I+g*G+p*J,r[10]=m*E+y*z+g*Y+p*Q,r[14]=m*k+y*H+g*W+p*se,r[3]=x*A+T*U+b*N+R*ce,r[7]=x*v+T*I+b*G+R*J,r[11]=x*E+T*z+b*Y+R*Q,r[15]=x*k+T*H+b*W+R*se,this}multiplyScalar(e){let t=this.elements;return t[0]*=e,t[4]*=e,t[8]*=e,t[12]*=e,t[1]*=e,t[5]*=e,t[9]*=e,t[13]*=e,t[2]*=e,t[6]*=e,t[10]*=e,t[14]*=e,t[3]*=e,t[7]*=e,t[11]*=e,t[15]*=e,this}determinant(){let e=this.elements,t=e[0],i=e[4],s=e[8],r=e[12],o=e[1],a=e[5],l=e[9],c=e[13],u=e[2],h=e[6],d=e[10],f=e[14],m=e[3],y=e[7],g=e[11],p=e[15],x=l*f-c*d,T=a*f-c*h,b=a*d-l*h,R=o*f-c*u,A=o*d-l*u,v=o*h-a*u;return t*(y*x-g*T+p*b)-i*(m*x-g*R+p*A)+s*(m*T-y*R+p*v)-r*(m*b-y*A+g*v)}determinantAffine(){let e=this.elements,t=e[0],i=e[4],s=e[8],r=e[1],o=e[5],a=e[9],l=e[2],c=e[6],u=e[10];return t*(o*u-a*c)-i*(r*u-a*l)+s*(r*c-o*l)}transpose(){let e=this.elements,t;return t=e[1],e[1]=e[4],e[4]=t,t=e[2],e[2]=e[8],e[8]=t,t=e[6],e[6]=e[9],e[9]=t,t=e[3],e[3]=e[12],e[12]=t,t=e[7],e[7]=e[13],e[13]=t,t=e[11],e[11]=e[14],e[14]=t,this}setPosition(e,t,i){let s=this.elements;return e.isVector3?(s[12]=e.x,s[13]=e.y,s[14]=e.z):(s[12]=e,s[13]=t,s[14]=i),this}invert(){let e=this.elements,t=e[0],i=e[1],s=e[2],r=e[3],o=e[4],a=e[5],l=e[6],c=e[7],u=e[8],h=e[9],d=e[10],f=e[11],m=e[12],y=e[13],g=e[14],p=e[15],x=t*a-i*o,T=t*l-s*o,b=t*c-r*o,R=i*l-s*a,A=i*c-r*a,v=s*c-r*l,E=u*y-h*m,k=u*g-d*m,U=u*p-f*m,I=h*g-d*y,z=h*p-f*y,H=d*p-f*g,N=x*H-T*z+b*I+R*U-A*k+v*E;if(N===0)return this.set(0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0);let G=1/N;return e[0]=(a*H-l*z+c*I)*G,e[1]=(s*z-i*H-r*I)*G,e[2]=(y*v-g*A+p*R)*G,e[3]=(d*A-h*v-f*R)*G,e[4]=(l*U-o*H-c*k)*G,e[5]=(t*H-s*U+r*k)*G,e[6]=(g*b-m*v-p*T)*G,e[7]=(u*v-d*b+f*T)*G,e[8]=(o*z-a*U+c*E)*G,e[9]=(i*U-t*z-r*E)*G,e[10]=(m*A-y*b+p*x)*G,e[11]=(h*b-u*A-f*x)*G,e[12]=(a*k-o*I-l*E)*G,e[13]=(t*I-i*k+s*E)*G,e[14]=(y*T-m*R-g*x)*G,e[15]=(u*R-h*T+d*x)*G,this}scale(e){let t=this.elements,i=e.x,s=e.y,r=e.z;return t[0]*=i,t[4]*=s,t[8]*=r,t[1]*=i,t[5]*=s,t[9]*=r,t[2]*=i,t[6]*=s,t[10]*=r,t[3]*=i,t[7]*=s,t[11]*=r,this}getMaxScaleOnAxis(){let e=this.elements,t=e[0]*e[0]+e[1]*e[1]+e[2]*e[2],i=e[4]*e[4]+e[5]*e[5]+e[6]*e[6],s=e[8]*e[8]+e[9]*e[9]+e[10]*e[10];return Math.sqrt(Math.max(t,i,s))}makeTranslation(e,t,i){return e.isVector3?this.set(1,0,0,e.x,0,1,0,e.y,0,0,1,e.z,0,0,0,1):this.set(1,0,0,e,0,1,0,t,0,0,1,i,0,0,0,1),this}makeRotationX(e){let t=Math.cos(e),i=Math.sin(e);return this.set(1,0,0,0,0,t,-i,0,0,i,t,0,0,0,0,1),this}makeRotationY(e){let t=Math.cos(e),i=Math.sin(e);return this.set(t,0,i,0,0,1,0,0,-i,0,t,0,0,0,0,1),this}makeRotationZ(e){let t=Math.cos(e),i=Math.sin(e);return this.set(t,-i,0,0,i,t,0,0,0,0,1,0,0,0,0,1),this}makeRotationAxis(e,t){let i=Math.cos(t),s=Math.sin(t),r=1-i,o=e.x,a=e.y,l=e.z,c=r*o,u=r*a;return this.set(c*o+i,c*a-s*l,c*l+s*a,0,c*a+s*l,u*a+i,u*l-s*o,0,c*l-s*a,u*l+s*o,r*l*l+i,0,0,0,0,1),this}makeScale(e,t,i){return this.set(e,0,0,0,0,t,0,0,0,0,i,0,0,0,0,1),this}makeShear(e,t,i,s,r,o){return this.set(1,i,r,0,e,1,o,0,t,s,1,0,0,0,0,1),this}compose(e,t,i){let s=this.elements,r=t._x,o=t._y,a=t._z,l=t._w,c=r+r,u=o+o,h=a+a,d=r*c,f=r*u,m=r*h,y=o*u,g=o*h,p=a*h,x=l*c,T=l*u,b=l*h,R=i.x,A=i.y,v=i.z;return s[0]=(1-(y+p))*R,s[1]=(f+b)*R,s[2]=(m-T)*R,s[3]=0,s[4]=(f-b)*A,s[5]=(1-(d+p))*A,s[6]=(g+x)*A,s[7]=0,s[8]=(m+T)*v,s[9]=(g-x)*v,s[10]=(1-(d+y))*v,s[11]=0,s[12]=e.x,s[13]=e.y,s[14]=e.z,s[15]=1,this}decompose(e,t,i){let s=this.elements;e.x=s[12],e.y=s[13],e.z=s[14];let r=this.determinantAffine();if(r===0)return i.set(1,1,1),t.identity(),this;let o=Pa.set(s[0],s[1],s[2]).length(),a=Pa.set(s[4],s[5],s[6]).length(),l=Pa.set(s[8],s[9],s[10]).length();r<0&&(o=-o),xs.copy(this);let c=1/o,u=1/a,h=1/l;return xs.elements[0]*=c,xs.elements[1]*=c,xs.elements[2]*=c,xs.elements[4]*=u,xs.elements[5]*=u,xs.elements[6]*=u,xs.elements[8]*=h,xs.elements[9]*=h,xs.elements[10]*=h,t.setFromRotationMatrix(xs),i.x=o,i.y=a,i.z=l,this}makePerspective(e,t,i,s,r,o,a=is,l=!1){let c=this.elements,u=2*r/(t-e),h=2*r/(i-s),d=(t+e)/(t-e),f=(i+s)/(i-s),m,y;if(l)m=r/(o-r),y=o*r/(o-r);else if(a===is)m=-(o+r)/(o-r),y=-2*o*r/(o-r);else if(a===Ya)m=-o/(o-r),y=-o*r/(o-r);else throw new Error("THREE.Matrix4.makePerspective(): Invalid coordinate system: "+a);return c[0]=u,c[4]=0,c[8]=d,c[12]=0,c[1]=0,c[5]=h,c[9]=f,c[13]=0,c[2]=0,c[6]=0,c[10]=m,c[14]=y,c[3]=0,c[7]=0,c[11]=-1,c[15]=0,this}makeOrthographic(e,t,i,s,r,o,a=is,l=!1){let c=this.elements,u=2/(t-e),h=2/(i-s),d=-(t+e)/(t-e),f=-(i+s)/(i-s),m,y;if(l)m=1/(o-r),y=o/(o-r);else if(a===is)m=-2/(o-r),y=-(o+r)/(o-r);else if(a===Ya)m=-1/(o-r),y=-r/(o-r);else throw new Error("THREE.Matrix4.makeOrthographic(): Invalid coordinate system: "+a);return c[0]=u,c[4]=0,c[8]=0,c[12]=d,c[1]=0,c[5]=h,c[9]=0,c[13]=f,c[2]=0,c[6]=0,c[10]=m,c[14]=y,c[3]=0,c[7]=0,c[11]=0,c[15]=1,this}equals(e){let t=this.elements,i=e.elements;for(let s=0;s<16;s++)if(t[s]!==i[s])return!1;return!0}fromArray(e,t=0){for(let i=0;i<16;i++)this.elements[i]=e[i+t];return this}toArray(e=[],t=0){let i=this.elements;return e[t]=i[0],e[t+1]=i[1],e[t+2]=i[2],e[t+3]=i[3],e[t+4]=i[4],e[t+5]=i[5],e[t+6]=i[6],e[t+7]=i[7],e[t+8]=i[8],e[t+9]=i[9],e[t+10]=i[10],e[t+11]=i[11],e[t+12]=i[12],e[t+13]=i[13],e[t+14]=i[14],e[t+15]=i[15],e}},Pa=new B,xs=new ht,cw=new B(0,0,0),uw=new B(1,1,1),Wr=new B,$u=new B,Gi=new B,S_=new ht,M_=new rs,yr=class n{constructor(e=0,t=0,i=0,s=n.DEFAULT_ORDER){this.isEuler=!0,this._x=e,this._y=t,this._z=i,this._order=s}get x(){return this._x}set x(e){this._x=e,this._onChangeCallback()}get y(){return this._y}set y(e){this._y=e,this._onChangeCallback()}get z(){return this._z}set z(e){this._z=e,this._onChangeCallback()}get order(){return this._order}set order(e){this._order=e,this._onChangeCallback()}set(e,t,i,s=this._order){return this._x=e,this._y=t,this._z=i,this._order=s,this._onChangeCallback(),this}clone(){return new this.constructor(this._x,this._y,this._z,this._order)}copy(e){return this._x=e._x,this._y=e._y,this._z=e._z,this._order=e._order,this._onChangeCallback(),this}setFromRotationMatrix(e,t=this._order,i=!0){let s=e.elements,r=s[0],o=s[4],a=s[8],l=s[1],c=s[5],u=s[9],h=s[2],d=s[6],f=s[10];switch(t){case"XYZ":this._y=Math.asin(ut(a,-1,1)),Math.abs(a)<.9999999?(this._x=Math.atan2(-u,f),this._z=Math.atan2(-o,r)):(this._x=Math.atan2(d,c),this._z=0);break;case"YXZ":this._x=Math.asin(-ut(u,-1,1)),Math.abs(u)<.9999999?(this._y=Math.atan2(a,f),this._z=Math.atan2(l,c)):(this._y=Math.atan2(-h,r),this._z=0);break;case"ZXY":this._x=Math.asin(ut(d,-1,1)),Math.abs(d)<.9999999?(this._y=Math.atan2(-h,f),this._z=Math.atan2(-o,c)):(this._y=0,this._z=Math.atan2(l,r));break;case"ZYX":this._y=Math.asin(-ut(h,-1,1)),Math.abs(h)<.9999999?(this._x=Math.atan2(d,f),this._z=Math.atan2(l,r)):(this._x=0,this._z=Math.atan2(-o,c));break;case"YZX":this._z=Math.asin(ut(l,-1,1)),Math.abs(l)<.9999999?(this._x=Math.atan2(-u,c),this._y=Math.atan2(-h,r)):(this._x=0,this._y=Math.atan2(a,f));break;case"XZY":this._z=Math.asin(-ut(o,-1,1)),Math.abs(o)<.9999999?(this._x=Math.atan2(d,c),this._y=Math.atan2(a,r)):(this._x=Math.atan2(-u,f),this._y=0);break;default:Ze("Euler: .setFromRotationMatrix() encountered an unknown order: "+t)}return this._order=t,i===!0&&this._onChangeCallback(),this}setFromQuaternion(e,t,i){return S_.makeRotationFromQuaternion(e),this.setFromRotationMatrix(S_,t,i)}setFromVector3(e,t=this._order){return this.set(e.x,e.y,e.z,t)}reorder(e){return M_.setFromEuler(this),this.setFromQuaternion(M_,e)}equals(e){return e._x===this._x&&e._y===this._y&&e._z===this._z&&e._order===this._order}fromArray(e){return this._x=e[0],this._y=e[1],this._z=e[2],e[3]!==void 0&&(this._order=e[3]),this._onChangeCallback(),this}toArray(e=[],t=0){return e[t]=this._x,e[t+1]=this._y,e[t+2]=this._z,e[t+3]=this._order,e}_onChange(e){return this._onChangeCallback=e,this}_onChangeCallback(){}*[Symbol.iterator](){yield this._x,yield this._y,yield this._z,yield this._order}};yr.DEFAULT_ORDER="XYZ";var gc=class{constructor(){this.mask=1}set(e){this.mask=(1<<e|0)>>>0}enable(e){this.mask|=1<<e|0}enableAll(){this.mask=-1}toggle(e){this.mask^=1<<e|0}disable(e){this.mask&=~(1<<e|0)}disableAll(){this.mask=0}test(e){return(this.mask&e.mask)!==0}isEnabled(e){return(this.mask&(1<<e|0))!==0}},hw=0,w_=new B,Ia=new rs,dr=new ht,Gu=new B,nc=new B,dw=new B,fw=new rs,E_=new B(1,0,0),T_=new B(0,1,0),A_=new B(0,0,1),C_={type:"added"},pw={type:"removed"},La={type:"childadded",child:null},Lp={type:"childremoved",child:null},ti=class n extends Hs{constructor(){super(),this.isObject3D=!0,Object.defineProperty(this,"id",{value:hw++}),this.uuid=io(),this.name="",this.type="Object3D",this.parent=null,this.children=[],this.up=n.DEFAULT_UP.clone();let e=new B,t=new yr,i=new rs,s=new B(1,1,1);function r(){i.setFromEuler(t,!1)}function o(){t.setFromQuaternion(i,void 0,!1)}t._onChange(r),i._onChange(o),Object.defineProperties(this,{position:{configurable:!0,enumerable:!0,value:e},rotation:{configurable:!0,enumerable:!0,value:t},quaternion:{configurable:!0,enumerable:!0,value:i},scale:{configurable:!0,enumerable:!0,value:s},modelViewMatrix:{value:new ht},normalMatrix:{value:new nt}}),this.matrix=new ht,this.matrixWorld=new ht,this.matrixAutoUpdate=n.DEFAULT_MATRIX_AUTO_UPDATE,this.matrixWorldAutoUpdate=n.DEFAULT_MATRIX_WORLD_AUTO_UPDATE,this.matrixWorldNeedsUpdate=!1,this.layers=new gc,this.visible=!0,this.castShadow=!1,this.receiveShadow=!1,this.frustumCulled=!0,this.renderOrder=0,this.animations=[],this.customDepthMaterial=void 0,this.customDistanceMaterial=void 0,this.static=!1,this.userData={},this.pivot=null}onBeforeShadow(){}onAfterShadow(){}onBeforeRender(){}onAfterRender(){}applyMatrix4(e){this.matrixAutoUpdate&&this.updateMatrix(),this.matrix.premultiply(e),this.matrix.decompose(this.position,this.quaternion,this.scale),this.pivot!==null&&this.position.copy(this.pivot).applyMatrix4(this.matrix).sub(this.pivot)}applyQuaternion(e){return this.quaternion.premultiply(e),this}setRotationFromAxisAngle(e,t){this.quaternion.setFromAxisAngle(e,t)}setRotationFromEuler(e){this.quaternion.setFromEuler(e,!0)}setRotationFromMatrix(e){this.quaternion.setFromRotationMatrix(e)}setRotationFromQuaternion(e){this.quaternion.copy(e)}rotateOnAxis(e,t){return Ia.setFromAxisAngle(e,t),this.quaternion.multiply(Ia),this}rotateOnWorldAxis(e,t){return Ia.setFromAxisAngle(e,t),this.quaternion.premultiply(Ia),this}rotateX(e){return this.rotateOnAxis(E_,e)}rotateY(e){return this.rotateOnAxis(T_,e)}rotateZ(e){return this.rotateOnAxis(A_,e)}translateOnAxis(e,t){return w_.copy(e).applyQuaternion(this.quaternion),this.position.add(w_.multiplyScalar(t)),this}translateX(e){return this.translateOnAxis(E_,e)}translateY(e){return this.translateOnAxis(T_,e)}translateZ(e){return this.translateOnAxis(A_,e)}localToWorld(e){return this.updateWorldMatrix(!0,!1),e.applyMatrix4(this.matrixWorld)}worldToLocal(e){return this.updateWorldMatrix(!0,!1),e.applyMatrix4(dr.copy(this.matrixWorld).invert())}lookAt(e,t,i){e.isVector3?Gu.copy(e):Gu.set(e,t,i);let s=this.parent;this.updateWorldMatrix(!0,!1),nc.setFromMatrixPosition(this.matrixWorld),this.isCamera||this.isLight?dr.lookAt(nc,Gu,this.up):dr.lookAt(Gu,nc,this.up),this.quaternion.setFromRotationMatrix(dr),s&&(dr.extractRotation(s.matrixWorld),Ia.setFromRotationMatrix(dr),this.quaternion.premultiply(Ia.invert()))}add(e){if(arguments.length>1){for(let t=0;t<arguments.length;t++)this.add(arguments[t]);return this}return e===this?(tt("Object3D.add: object can't be added as a child of itself.",e),this):(e&&e.isObject3D?(e.removeFromParent(),e.parent=this,this.children.push(e),e.dispatchEvent(C_),La.child=e,this.dispatchEvent(La),La.child=null):tt("Object3D.add: object not an instance of THREE.Object3D.",e),this)}remove(e){if(arguments.length>1){for(let i=0;i<arguments.length;i++)this.remove(arguments[i]);return this}let t=this.children.indexOf(e);return t!==-1&&(e.parent=null,this.children.splice(t,1),e.dispatchEvent(pw),Lp.child=e,this.dispatchEvent(Lp),Lp.child=null),this}removeFromParent(){let e=this.parent;return e!==null&&e.remove(this),this}clear(){return this.remove(...this.children)}attach(e){return this.updateWorldMatrix(!0,!1),dr.copy(this.matrixWorld).invert(),e.parent!==null&&(e.parent.updateWorldMatrix(!0,!1),dr.multiply(e.parent.matrixWorld)),e.applyMatrix4(dr),e.removeFromParent(),e.parent=this,this.children.push(e),e.updateWorldMatrix(!1,!0),e.dispatchEvent(C_),La.child=e,this.dispatchEvent(La),La.child=null,this}getObjectById(e){return this.getObjectByProperty("id",e)}getObjectByName(e){return this.getObjectByProperty("name",e)}getObjectByProperty(e,t){if(this[e]===t)return this;for(let i=0,s=this.children.length;i<s;i++){let o=this.children[i].getObjectByProperty(e,t);if(o!==void 0)return o}}getObjectsByProperty(e,t,i=[]){this[e]===t&&i.push(this);let s=this.children;for(let r=0,o=s.length;r<o;r++)s[r].getObjectsByProperty(e,t,i);return i}getWorldPosition(e){return this.updateWorldMatrix(!0,!1),e.setFromMatrixPosition(this.matrixWorld)}getWorldQuaternion(e){return this.updateWorldMatrix(!0,!1),this.matrixWorld.decompose(nc,e,dw),e}getWorldScale(e){return this.updateWorldMatrix(!0,!1),this.matrixWorld.decompose(nc,fw,e),e}getWorldDirection(e){this.updateWorldMatrix(!0,!1);let t=this.matrixWorld.elements;return e.set(t[8],t[9],t[10]).normalize()}raycast(){}intersectsFrustum(){return!0}traverse(e){e(this);let t=this.children;for(let i=0,s=t.length;i<s;i++)t[i].traverse(e)}traverseVisible(e){if(this.visible===!1)return;e(this);let t=this.children;for(let i=0,s=t.length;i<s;i++)t[i].traverseVisible(e)}traverseAncestors(e){let t=this.parent;t!==null&&(e(t),t.traverseAncestors(e))}updateMatrix(){this.matrix.compose(this.position,this.quaternion,this.scale);let e=this.pivot;if(e!==null){let t=e.x,i=e.y,s=e.z,r=this.matrix.elements;r[12]+=t-r[0]*t-r[4]*i-r[8]*s,r[13]+=i-r[1]*t-r[5]*i-r[9]*s,r[14]+=s-r[2]*t-r[6]*i-r[10]*s}this.matrixWorldNeedsUpdate=!0}updateMatrixWorld(e){this.matrixAutoUpdate&&this.updateMatrix(),(this.matrixWorldNeedsUpdate||e)&&(this.matrixWorldAutoUpdate===!0&&(this.parent===null?this.matrixWorld.copy(this.matrix):this.matrixWorld.multiplyMatrices(this.parent.matrixWorld,this.matrix)),this.matrixWorldNeedsUpdate=!1,e=!0);let t=this.children;for(let i=0,s=t.length;i<s;i++)t[i].updateMatrixWorld(e)}updateWorldMatrix(e,t,i=!1){let s=this.parent;if(e===!0&&s!==null&&s.updateWorldMatrix(!0,!1),this.matrixAutoUpdate&&this.updateMatrix(),(this.matrixWorldNeedsUpdate||i)&&(this.matrixWorldAutoUpdate===!0&&(this.parent===null?this.matrixWorld.copy(this.matrix):this.matrixWorld.multiplyMatrices(this.parent.matrixWorld,this.matrix)),this.matrixWorldNeedsUpdate=!1,i=!0),t===!0){let r=this.children;for(let o=0,a=r.length;o<a;o++)r[o].updateWorldMatrix(!1,!0,i)}}toJSON(e){let t=e===void 0||typeof e=="string",i={};t&&(e={geometries:{},materials:{},textures:{},images:{},shapes:{},skeletons:{},animations:{},nodes:{}},i.metadata={version:4.7,type:"Object",generator:"Object3D.toJSON"});let s={};s.uuid=this.uuid,s.type=this.type,s.name=this.name,s.castShadow=this.castShadow,s.receiveShadow=this.receiveShadow,s.visible=this.visible,s.frustumCulled=this.frustumCulled,s.renderOrder=this.renderOrder,s.static=this.static,s.matrixAutoUpdate=this.matrixAutoUpdate,Object.keys(this.userData).length>0&&(s.userData=this.userData),s.layers=this.layers.mask,s.matrix=this.matrix.toArray(),s.up=this.up.toArray(),this.pivot!==null&&(s.pivot=this.pivot.toArray()),this.morphTargetDictionary!==void 0&&(s.morphTargetDictionary=Object.assign({},this.morphTargetDictionary)),this.morphTargetInfluences!==void 0&&(s.morphTargetInfluences=this.morphTargetInfluences.slice()),this.isInstancedMesh&&(s.type="InstancedMesh",s.count=this.count,s.instanceMatrix=this.instanceMatrix.toJSON(),this.instanceColor!==null&&(s.instanceColor=this.instanceColor.toJSON())),this.isBatchedMesh&&(s.type="BatchedMesh",s.perObjectFrustumCulled=this.perObjectFrustumCulled,s.sortObjects=this.sortObjects,s.drawRanges=this._drawRanges,s.reservedRanges=this._reservedRanges,s.geometryInfo=this._geometryInfo.map(a=>({...a,boundingBox:a.boundingBox?a.boundingBox.toJSON():void 0,boundingSphere:a.boundingSphere?a.boundingSphere.toJSON():void 0})),s.instanceInfo=this._instanceInfo.map(a=>({...a})),s.availableInstanceIds=this._availableInstanceIds.slice(),s.availableGeometryIds=this._availableGeometryIds.slice(),s.nextIndexStart=this._nextIndexStart,s.nextVertexStart=this._nextVertexStart,s.geometryCount=this._geometryCount,s.maxInstanceCount=this._maxInstanceCount,s.maxVertexCount=this._maxVertexCount,s.maxIndexCount=this._maxIndexCount,s.geometryInitialized=this._geometryInitialized,s.matricesTexture=this._matricesTexture.toJSON(e),s.indirectTexture=this._indirectTexture.toJSON(e),this._colorsTexture!==null&&(s.colorsTexture=this._colorsTexture.toJSON(e)),this.boundingSphere!==null&&(s.boundingSphere=this.boundingSphere.toJSON()),this.boundingBox!==null&&(s.boundingBox=this.boundingBox.toJSON()));function r(a,l){return a[l.uuid]===void 0&&(a[l.uuid]=l.toJSON(e)),l.uuid}if(this.isScene)this.background&&(this.background.isColor?s.background=this.background.toJSON():this.background.isTexture&&(s.background=this.background.toJSON(e).uuid)),this.environment&&this.environment.isTexture&&this.environment.isRenderTargetTexture!==!0&&(s.environment=this.environment.toJSON(e).uuid);else if(this.isMesh||this.isLine||this.isPoints){s.geometry=r(e.geometries,this.geometry);let a=this.geometry.parameters;if(a!==void 0&&a.shapes!==void 0){let l=a.shapes;if(Array.isArray(l))for(let c=0,u=l.length;c<u;c++){let h=l[c];r(e.shapes,h)}else r(e.shapes,l)}}if(this.isSkinnedMesh&&(s.bindMode=this.bindMode,s.bindMatrix=this.bindMatrix.toArray(),this.skeleton!==void 0&&(r(e.skeletons,this.skeleton),s.skeleton=this.skeleton.uuid)),this.material!==void 0)if(Array.isArray(this.material)){let a=[];for(let l=0,c=this.material.length;l<c;l++)a.push(r(e.materials,this.material[l]));s.material=a}else s.material=r(e.materials,this.material);if(this.children.length>0){s.children=[];for(let a=0;a<this.children.length;a++)s.children.push(this.children[a].toJSON(e).object)}if(this.animations.length>0){s.animations=[];for(let a=0;a<this.animations.length;a++){let l=this.animations[a];s.animations.push(r(e.animations,l))}}if(t){let a=o(e.geometries),l=o(e.materials),c=o(e.textures),u=o(e.images),h=o(e.shapes),d=o(e.skeletons),f=o(e.animations),m=o(e.nodes);a.length>0&&(i.geometries=a),l.length>0&&(i.materials=l),c.length>0&&(i.textures=c),u.length>0&&(i.images=u),h.length>0&&(i.shapes=h),d.length>0&&(i.skeletons=d),f.length>0&&(i.animations=f),m.length>0&&(i.nodes=m)}return i.object=s,i;function o(a){let l=[];for(let c in a){let u=a[c];delete u.metadata,l.push(u)}return l}}clone(e){return new this.constructor().copy(this,e)}copy(e,t=!0){if(this.name=e.name,this.up.copy(e.up),this.position.copy(e.position),this.rotation.order=e.rotation.order,this.quaternion.copy(e.quaternion),this.scale.copy(e.scale),this.pivot=e.pivot!==null?e.pivot.clone():null,this.matrix.copy(e.matrix),this.matrixWorld.copy(e.matrixWorld),this.matrixAutoUpdate=e.matrixAutoUpdate,this.matrixWorldAutoUpdate=e.matrixWorldAutoUpdate,this.matrixWorldNeedsUpdate=e.matrixWorldNeedsUpdate,this.layers.mask=e.layers.mask,this.visible=e.visible,this.castShadow=e.castShadow,this.receiveShadow=e.receiveShadow,this.frustumCulled=e.frustumCulled,this.renderOrder=e.renderOrder,this.static=e.static,this.animations=e.animations.slice(),this.userData=JSON.parse(JSON.stringify(e.userData)),t===!0)for(let i=0;i<e.children.length;i++){let s=e.children[i];this.add(s.clone())}return this}dispose(){this.dispatchEvent({type:"dispose"})}};ti.DEFAULT_UP=new B(0,1,0);ti.DEFAULT_MATRIX_AUTO_UPDATE=!0;ti.DEFAULT_MATRIX_WORLD_AUTO_UPDATE=!0;var ss=class extends ti{constructor(){super(),this.isGroup=!0,this.type="Group"}},mw={type:"move"},Ka=class{constructor(){this._targetRay=null,this._grip=null,this._hand=null}getHandSpace(){return this._hand===null&&(this._hand=new ss,this._hand.matrixAutoUpdate=!1,this._hand.visible=!1,this._hand.joints={},this._hand.inputState={pinching:!1}),this._hand}getTargetRaySpace(){return this._targetRay===null&&(this._targetRay=new ss,this._targetRay.matrixAutoUpdate=!1,this._targetRay.visible=!1,this._targetRay.hasLinearVelocity=!1,this._targetRay.linearVelocity=new B,this._targetRay.hasAngularVelocity=!1,this._targetRay.angularVelocity=new B),this._targetRay}getGripSpace(){return this._grip===null&&(this._grip=new ss,this._grip.matrixAutoUpdate=!1,this._grip.visible=!1,this._grip.hasLinearVelocity=!1,this._grip.linearVelocity=new B,this._grip.hasAngularVelocity=!1,this._grip.angularVelocity=new B,this._grip.eventsEnabled=!1),this._grip}dispatchEvent(e){return this._targetRay!==null&&this._targetRay.dispatchEvent(e),this._grip!==null&&this._grip.dispatchEvent(e),this._hand!==null&&this._hand.dispatchEvent(e),this}connect(e){if(e&&e.hand){let t=this._hand;if(t)for(let i of e.hand.values())this._getHandJoint(t,i)}return this.dispatchEvent({type:"connected",data:e}),this}disconnect(e){return this.dispatchEvent({type:"disconnected",data:e}),this._targetRay!==null&&(this._targetRay.visible=!1),this._grip!==null&&(this._grip.visible=!1),this._hand!==null&&(this._hand.visible=!1),this}update(e,t,i){let s=null,r=null,o=null,a=this._targetRay,l=this._grip,c=this._hand;if(e&&t.session.visibilityState!=="visible-blurred"){if(c&&e.hand){o=!0;for(let y of e.hand.values()){let g=t.getJointPose(y,i),p=this._getHandJoint(c,y);g!==null&&(p.matrix.fromArray(g.transform.matrix),p.matrix.decompose(p.position,p.quaternion,p.scale),p.matrixWorldNeedsUpdate=!0,p.jointRadius=g.radius),p.visible=g!==null}let u=c.joints["index-finger-tip"],h=c.joints["thumb-tip"],d=u.position.distanceTo(h.position),f=.02,m=.005;c.inputState.pinching&&d>f+m?(c.inputState.pinching=!1,this.dispatchEvent({type:"pinchend",handedness:e.handedness,target:this})):!c.inputState.pinching&&d<=f-m&&(c.inputState.pinching=!0,this.dispatchEvent({type:"pinchstart",handedness:e.handedness,target:this}))}else l!==null&&e.gripSpace&&(r=t.getPose(e.gripSpace,i),r!==null&&(l.matrix.fromArray(r.transform.matrix),l.matrix.decompose(l.position,l.quaternion,l.scale),l.matrixWorldNeedsUpdate=!0,r.linearVelocity?(l.hasLinearVelocity=!0,l.linearVelocity.copy(r.linearVelocity)):l.hasLinearVelocity=!1,r.angularVelocity?(l.hasAngularVelocity=!0,l.angularVelocity.copy(r.angularVelocity)):l.hasAngularVelocity=!1,l.eventsEnabled&&l.dispatchEvent({type:"gripUpdated",data:e,target:this})));a!==null&&(s=t.getPose(e.targetRaySpace,i),s===null&&r!==null&&(s=r),s!==null&&(a.matrix.fromArray(s.transform.matrix),a.matrix.decompose(a.position,a.quaternion,a.scale),a.matrixWorldNeedsUpdate=!0,s.linearVelocity?(a.hasLinearVelocity=!0,a.linearVelocity.copy(s.linearVelocity)):a.hasLinearVelocity=!1,s.angularVelocity?(a.hasAngularVelocity=!0,a.angularVelocity.copy(s.angularVelocity)):a.hasAngularVelocity=!1,this.dispatchEvent(mw)))}return a!==null&&(a.visible=s!==null),l!==null&&(l.visible=r!==null),c!==null&&(c.visible=o!==null),this}_getHandJoint(e,t){if(e.joints[t.jointName]===void 0){let i=new ss;i.matrixAutoUpdate=!1,i.visible=!1,e.joints[t.jointName]=i,e.add(i)}return e.joints[t.jointName]}},Pv={aliceblue:15792383,antiquewhite:16444375,aqua:65535,aquamarine:8388564,azure:15794175,beige:16119260,bisque:16770244,black:0,blanchedalmond:16772045,blue:255,blueviolet:9055202,brown:10824234,burlywood:14596231,cadetblue:6266528,chartreuse:8388352,chocolate:13789470,coral:16744272,cornflowerblue:6591981,cornsilk:16775388,crimson:14423100,cyan:65535,darkblue:139,darkcyan:35723,darkgoldenrod:12092939,darkgray:11119017,darkgreen:25600,darkgrey:11119017,darkkhaki:12433259,darkmagenta:9109643,darkolivegreen:5597999,darkorange:16747520,darkorchid:10040012,darkred:9109504,darksalmon:15308410,darkseagreen:9419919,darkslateblue:4734347,darkslategray:3100495,darkslategrey:3100495,darkturquoise:52945,darkviolet:9699539,deeppink:16716947,deepskyblue:49151,dimgray:6908265,dimgrey:6908265,dodgerblue:2003199,firebrick:11674146,floralwhite:16775920,forestgreen:2263842,fuchsia:16711935,gainsboro:14474460,ghostwhite:16316671,gold:16766720,goldenrod:14329120,gray:8421504,green:32768,greenyellow:11403055,grey:8421504,honeydew:15794160,hotpink:16738740,indianred:13458524,indigo:4915330,ivory:16777200,khaki:15787660,lavender:15132410,lavenderblush:16773365,lawngreen:8190976,lemonchiffon:16775885,lightblue:11393254,lightcoral:15761536,lightcyan:14745599,lightgoldenrodyellow:16448210,lightgray:13882323,lightgreen:9498256,lightgrey:13882323,lightpink:16758465,lightsalmon:16752762,lightseagreen:2142890,lightskyblue:8900346,lightslategray:7833753,lightslategrey:7833753,lightsteelblue:11584734,lightyellow:16777184,lime:65280,limegreen:3329330,linen:16445670,magenta:16711935,maroon:8388608,mediumaquamarine:6737322,mediumblue:205,mediumorchid:12211667,mediumpurple:9662683,mediumseagreen:3978097,mediumslateblue:8087790,mediumspringgreen:64154,mediumturquoise:4772300,mediumvioletred:13047173,midnightblue:1644912,mintcream:16121850,mistyrose:16770273,moccasin:16770229,navajowhite:16768685,navy:128,oldlace:16643558,olive:8421376,olivedrab:7048739,orange:16753920,orangered:16729344,orchid:14315734,palegoldenrod:15657130,palegreen:10025880,paleturquoise:11529966,palevioletred:14381203,papayawhip:16773077,peachpuff:16767673,peru:13468991,pink:16761035,plum:14524637,powderblue:11591910,purple:8388736,rebeccapurple:6697881,red:16711680,rosybrown:12357519,royalblue:4286945,saddlebrown:9127187,salmon:16416882,sandybrown:16032864,seagreen:3050327,seashell:16774638,sienna:10506797,silver:12632256,skyblue:8900331,slateblue:6970061,slategray:7372944,slategrey:7372944,snow:16775930,springgreen:65407,steelblue:4620980,tan:13808780,teal:32896,thistle:14204888,tomato:16737095,turquoise:4251856,violet:15631086,wheat:16113331,white:16777215,whitesmoke:16119285,yellow:16776960,yellowgreen:10145074},Xr={h:0,s:0,l:0},Wu={h:0,s:0,l:0};function Dp(n,e,t){return t<0&&(t+=1),t>1&&(t-=1),t<1/6?n+(e-n)*6*t:t<1/2?e:t<2/3?n+(e-n)*6*(2/3-t):n}var lt=class{constructor(e,t,i){return this.isColor=!0,this.r=1,this.g=1,this.b=1,this.set(e,t,i)}set(e,t,i){if(t===void 0&&i===void 0){let s=e;s&&s.isColor?this.copy(s):typeof s=="number"?this.setHex(s):typeof s=="string"&&this.setStyle(s)}else this.setRGB(e,t,i);return this}setScalar(e){return this.r=e,this.g=e,this.b=e,this}setHex(e,t=Xi){return e=Math.floor(e),this.r=(e>>16&255)/255,this.g=(e>>8&255)/255,this.b=(e&255)/255,vt.colorSpaceToWorking(this,t),this}setRGB(e,t,i,s=vt.workingColorSpace){return this.r=e,this.g=t,this.b=i,vt.colorSpaceToWorking(this,s),this}setHSL(e,t,i,s=vt.workingColorSpace){if(e=Am(e,1),t=ut(t,0,1),i=ut(i,0,1),t===0)this.r=this.g=this.b=i;else{let r=i<=.5?i*(1+t):i+t-i*t,o=2*i-r;this.r=Dp(o,r,e+1/3),this.g=Dp(o,r,e),this.b=Dp(o,r,e-1/3)}return vt.colorSpaceToWorking(this,s),this}setStyle(e,t=Xi){function i(r){r!==void 0&&parseFloat(r)<1&&Ze("Color: Alpha component of "+e+" will be ignored.")}let s;if(s=/^(\w+)\(([^\)]*)\)/.exec(e)){let r,o=s[1],a=s[2];switch(o){case"rgb":case"rgba":if(r=/^\s*(\d+)\s*,\s*(\d+)\s*,\s*(\d+)\s*(?:,\s*(\d+(?:\.\d+)?|\.\d+)\s*)?$/.exec(a))return i(r[4]),this.setRGB(Math.min(255,parseInt(r[1],10))/255,Math.min(255,parseInt(r[2],10))/255,Math.min(255,parseInt(r[3],10))/255,t);if(r=/^\s*(\d+(?:\.\d+)?|\.\d+)\%\s*,\s*(\d+(?:\.\d+)?|\.\d+)\%\s*,\s*(\d+(?:\.\d+)?|\.\d+)\%\s*(?:,\s*(\d+(?:\.\d+)?|\.\d+)\s*)?$/.exec(a))return i(r[4]),this.setRGB(Math.min(100,parseFloat(r[1]))/100,Math.min(100,parseFloat(r[2]))/100,Math.min(100,parseFloat(r[3]))/100,t);break;case"hsl":case"hsla":if(r=/^\s*([+-]?(?:\d+(?:\.\d+)?|\.\d+))\s*,\s*(\d+(?:\.\d+)?|\.\d+)\%\s*,\s*(\d+(?:\.\d+)?|\.\d+)\%\s*(?:,\s*(\d+(?:\.\d+)?|\.\d+)\s*)?$/.exec(a))return i(r[4]),this.setHSL(parseFloat(r[1])/360,parseFloat(r[2])/100,parseFloat(r[3])/100,t);break;default:Ze("Color: Unknown color model "+e)}}else if(s=/^\#([A-Fa-f\d]+)$/.exec(e)){let r=s[1],o=r.length;if(o===3)return this.setRGB(parseInt(r.charAt(0),16)/15,parseInt(r.charAt(1),16)/15,parseInt(r.charAt(2),16)/15,t);if(o===6)return this.setHex(parseInt(r,16),t);Ze("Color: Invalid hex color "+e)}else if(e&&e.length>0)return this.setColorName(e,t);return this}setColorName(e,t=Xi){let i=Pv[e.toLowerCase()];return i!==void 0?this.setHex(i,t):Ze("Color: Unknown color "+e),this}clone(){return new this.constructor(this.r,this.g,this.b)}copy(e){return this.r=e.r,this.g=e.g,this.b=e.b,this}copySRGBToLinear(e){return this.r=_r(e.r),this.g=_r(e.g),this.b=_r(e.b),this}copyLinearToSRGB(e){return this.r=Wa(e.r),this.g=Wa(e.g),this.b=Wa(e.b),this}convertSRGBToLinear(){return this.copySRGBToLinear(this),this}convertLinearToSRGB(){return this.copyLinearToSRGB(this),this}getHex(e=Xi){return vt.workingToColorSpace(ui.copy(this),e),Math.round(ut(ui.r*255,0,255))*65536+Math.round(ut(ui.g*255,0,255))*256+Math.round(ut(ui.b*255,0,255))}getHexString(e=Xi){return("000000"+this.getHex(e).toString(16)).slice(-6)}getHSL(e,t=vt.workingColorSpace){vt.workingToColorSpace(ui.copy(this),t);let i=ui.r,s=ui.g,r=ui.b,o=Math.max(i,s,r),a=Math.min(i,s,r),l,c,u=(a+o)/2;if(a===o)l=0,c=0;else{let h=o-a;switch(c=u<=.5?h/(o+a):h/(2-o-a),o){case i:l=(s-r)/h+(s<r?6:0);break;case s:l=(r-i)/h+2;break;case r:l=(i-s)/h+4;break}l/=6}return e.h=l,e.s=c,e.l=u,e}getRGB(e,t=vt.workingColorSpace){return vt.workingToColorSpace(ui.copy(this),t),e.r=ui.r,e.g=ui.g,e.b=ui.b,e}getStyle(e=Xi){vt.workingToColorSpace(ui.copy(this),e);let t=ui.r,i=ui.g,s=ui.b;return e!==Xi?`color(${e} ${t.toFixed(3)} ${i.toFixed(3)} ${s.toFixed(3)})`:`rgb(${Math.round(t*255)},${Math.round(i*255)},${Math.round(s*255)})`}offsetHSL(e,t,i){return this.getHSL(Xr),this.setHSL(Xr.h+e,Xr.s+t,Xr.l+i)}add(e){return this.r+=e.r,this.g+=e.g,this.b+=e.b,this}addColors(e,t){return this.r=e.r+t.r,this.g=e.g+t.g,this.b=e.b+t.b,this}addScalar(e){return this.r+=e,this.g+=e,this.b+=e,this}sub(e){return this.r=Math.max(0,this.r-e.r),this.g=Math.max(0,this.g-e.g),this.b=Math.max(0,this.b-e.b),this}multiply(e){return this.r*=e.r,this.g*=e.g,this.b*=e.b,this}multiplyScalar(e){return this.r*=e,this.g*=e,this.b*=e,this}lerp(e,t){return this.r+=(e.r-this.r)*t,this.g+=(e.g-this.g)*t,this.b+=(e.b-this.b)*t,this}lerpColors(e,t,i){return this.r=e.r+(t.r-e.r)*i,this.g=e.g+(t.g-e.g)*i,this.b=e.b+(t.b-e.b)*i,this}lerpHSL(e,t){this.getHSL(Xr),e.getHSL(Wu);let i=uc(Xr.h,Wu.h,t),s=uc(Xr.s,Wu.s,t),r=uc(Xr.l,Wu.l,t);return this.setHSL(i,s,r),this}setFromVector3(e){return this.r=e.x,this.g=e.y,this.b=e.z,this}applyMatrix3(e){let t=this.r,i=this.g,s=this.b,r=e.elements;return this.r=r[0]*t+r[3]*i+r[6]*s,this.g=r[1]*t+r[4]*i+r[7]*s,this.b=r[2]*t+r[5]*i+r[8]*s,this}equals(e){return e.r===this.r&&e.g===this.g&&e.b===this.b}fromArray(e,t=0){return this.r=e[t],this.g=e[t+1],this.b=e[t+2],this}toArray(e=[],t=0){return e[t]=this.r,e[t+1]=this.g,e[t+2]=this.b,e}fromBufferAttribute(e,t){return this.r=e.getX(t),this.g=e.getY(t),this.b=e.getZ(t),this}toJSON(){return this.getHex()}*[Symbol.iterator](){yield this.r,yield this.g,yield this.b}},ui=new lt;lt.NAMES=Pv;var $s=class extends ti{constructor(){super(),this.isScene=!0,this.type="Scene",this.background=null,this.environment=null,this.fog=null,this.backgroundBlurriness=0,this.backgroundIntensity=1,this.backgroundRotation=new yr,this.environmentIntensity=1,this.environmentRotation=new yr,this.overrideMaterial=null,typeof __THREE_DEVTOOLS__<"u"&&__THREE_DEVTOOLS__.dispatchEvent(new CustomEvent("observe",{detail:this}))}copy(e,t){return super.copy(e,t),this.background=e.background!==null?e.background.clone():null,this.environment=e.environment!==null?e.environment.clone():null,this.fog=e.fog!==null?e.fog.clone():null,this.backgroundBlurriness=e.backgroundBlurriness,this.backgroundIntensity=e.backgroundIntensity,this.backgroundRotation.copy(e.backgroundRotation),this.environmentIntensity=e.environmentIntensity,this.environmentRotation.copy(e.environmentRotation),this.overrideMaterial=e.overrideMaterial!==null?e.overrideMaterial.clone():null,this.matrixAutoUpdate=e.matrixAutoUpdate,this}toJSON(e){let t=super.toJSON(e);return this.fog!==null&&(t.object.fog=this.fog.toJSON()),t.object.backgroundBlurriness=this.backgroundBlurriness,t.object.backgroundIntensity=this.backgroundIntensity,t.object.backgroundRotation=this.backgroundRotation.toArray(),t.object.environmentIntensity=this.environmentIntensity,t.object.environmentRotation=this.environmentRotation.toArray(),t}},bs=new B,fr=new B,Np=new B,pr=new B,Da=new B,Na=new B,R_=new B,Up=new B,Op=new B,Fp=new B,Bp=new It,kp=new It,zp=new It,Zr=class n{constructor(e=new B,t=new B,i=new B){this.a=e,this.b=t,this.c=i}static getNormal(e,t,i,s){s.subVectors(i,t),bs.subVectors(e,t),s.cross(bs);let r=s.lengthSq();return r>0?s.multiplyScalar(1/Math.sqrt(r)):s.set(0,0,0)}static getBarycoord(e,t,i,s,r){bs.subVectors(s,t),fr.subVectors(i,t),Np.subVectors(e,t);let o=bs.dot(bs),a=bs.dot(fr),l=bs.dot(Np),c=fr.dot(fr),u=fr.dot(Np),h=o*c-a*a;if(h===0)return r.set(0,0,0),null;let d=1/h,f=(c*l-a*u)*d,m=(o*u-a*l)*d;return r.set(1-f-m,m,f)}static containsPoint(e,t,i,s){return this.getBarycoord(e,t,i,s,pr)===null?!1:pr.x>=0&&pr.y>=0&&pr.x+pr.y<=1}static getInterpolation(e,t,i,s,r,o,a,l){return this.getBarycoord(e,t,i,s,pr)===null?(l.x=0,l.y=0,"z"in l&&(l.z=0),"w"in l&&(l.w=0),null):(l.setScalar(0),l.addScaledVector(r,pr.x),l.addScaledVector(o,pr.y),l.addScaledVector(a,pr.z),l)}static getInterpolatedAttribute(e,t,i,s,r,o){return Bp.setScalar(0),kp.setScalar(0),zp.setScalar(0),Bp.fromBufferAttribute(e,t),kp.fromBufferAttribute(e,i),zp.fromBufferAttribute(e,s),o.setScalar(0),o.addScaledVector(Bp,r.x),o.addScaledVector(kp,r.y),o.addScaledVector(zp,r.z),o}static isFrontFacing(e,t,i,s){return bs.subVectors(i,t),fr.subVectors(e,t),bs.cross(fr).dot(s)<0}set(e,t,i){return this.a.copy(e),this.b.copy(t),this.c.copy(i),this}setFromPointsAndIndices(e,t,i,s){return this.a.copy(e[t]),this.b.copy(e[i]),this.c.copy(e[s]),this}setFromAttributeAndIndices(e,t,i,s){return this.a.fromBufferAttribute(e,t),this.b.fromBufferAttribute(e,i),this.c.fromBufferAttribute(e,s),this}clone(){return new this.constructor().copy(this)}copy(e){return this.a.copy(e.a),this.b.copy(e.b),this.c.copy(e.c),this}getArea(){return bs.subVectors(this.c,this.b),fr.subVectors(this.a,this.b),bs.cross(fr).length()*.5}getMidpoint(e){return e.addVectors(this.a,this.b).add(this.c).multiplyScalar(1/3)}getNormal(e){return n.getNormal(this.a,this.b,this.c,e)}getPlane(e){return e.setFromCoplanarPoints(this.a,this.b,this.c)}getBarycoord(e,t){return n.getBarycoord(e,this.a,this.b,this.c,t)}getInterpolation(e,t,i,s,r){return n.getInterpolation(e,this.a,this.b,this.c,t,i,s,r)}containsPoint(e){return n.containsPoint(e,this.a,this.b,this.c)}isFrontFacing(e){return n.isFrontFacing(this.a,this.b,this.c,e)}intersectsBox(e){return e.intersectsTriangle(this)}closestPointToPoint(e,t){let i=this.a,s=this.b,r=this.c,o,a;Da.subVectors(s,i),Na.subVectors(r,i),Up.subVectors(e,i);let l=Da.dot(Up),c=Na.dot(Up);if(l<=0&&c<=0)return t.copy(i);Op.subVectors(e,s);let u=Da.dot(Op),h=Na.dot(Op);if(u>=0&&h<=u)return t.copy(s);let d=l*h-u*c;if(d<=0&&l>=0&&u<=0&&l-u>0)return o=l/(l-u),t.copy(i).addScaledVector(Da,o);Fp.subVectors(e,r);let f=Da.dot(Fp),m=Na.dot(Fp);if(m>=0&&f<=m)return t.copy(r);let y=f*c-l*m;if(y<=0&&c>=0&&m<=0)return a=c/(c-m),t.copy(i).addScaledVector(Na,a);let g=u*m-f*h;if(g<=0&&h-u>=0&&f-m>=0)return R_.subVectors(r,s),a=(h-u)/(h-u+(f-m)),t.copy(s).addScaledVector(R_,a);let p=1/(g+y+d);return o=y*p,a=d*p,t.copy(i).addScaledVector(Da,o).addScaledVector(Na,a)}equals(e){return e.a.equals(this.a)&&e.b.equals(this.b)&&e.c.equals(this.c)}},Fn=class{constructor(e=new B(1/0,1/0,1/0),t=new B(-1/0,-1/0,-1/0)){this.isBox3=!0,this.min=e,this.max=t}set(e,t){return this.min.copy(e),this.max.copy(t),this}setFromArray(e){this.makeEmpty();for(let t=0,i=e.length;t<i;t+=3)this.expandByPoint(Ss.fromArray(e,t));return this}setFromBufferAttribute(e){this.makeEmpty();for(let t=0,i=e.count;t<i;t++)this.expandByPoint(Ss.fromBufferAttribute(e,t));return this}setFromPoints(e){this.makeEmpty();for(let t=0,i=e.length;t<i;t++)this.expandByPoint(e[t]);return this}setFromCenterAndSize(e,t){let i=Ss.copy(t).multiplyScalar(.5);return this.min.copy(e).sub(i),this.max.copy(e).add(i),this}setFromObject(e,t=!1){return this.makeEmpty(),this.expandByObject(e,t)}clone(){return new this.constructor().copy(this)}copy(e){return this.min.copy(e.min),this.max.copy(e.max),this}makeEmpty(){return this.min.x=this.min.y=this.min.z=1/0,this.max.x=this.max.y=this.max.z=-1/0,this}isEmpty(){return this.max.x<this.min.x||this.max.y<this.min.y||this.max.z<this.min.z}getCenter(e){return this.isEmpty()?e.set(0,0,0):e.addVectors(this.min,this.max).multiplyScalar(.5)}getSize(e){return this.isEmpty()?e.set(0,0,0):e.subVectors(this.max,this.min)}expandByPoint(e){return this.min.min(e),this.max.max(e),this}expandByVector(e){return this.min.sub(e),this.max.add(e),this}expandByScalar(e){return this.min.addScalar(-e),this.max.addScalar(e),this}expandByObject(e,t=!1){e.updateWorldMatrix(!1,!1);let i=e.geometry;if(i!==void 0){let r=i.getAttribute("position");if(t===!0&&r!==void 0&&e.isInstancedMesh!==!0&&e.isBatchedMesh!==!0)for(let o=0,a=r.count;o<a;o++)e.isMesh===!0?e.getVertexPosition(o,Ss):Ss.fromBufferAttribute(r,o),Ss.applyMatrix4(e.matrixWorld),this.expandByPoint(Ss);else e.boundingBox!==void 0?(e.boundingBox===null&&e.computeBoundingBox(),Xu.copy(e.boundingBox)):(i.boundingBox===null&&i.computeBoundingBox(),Xu.copy(i.boundingBox)),Xu.applyMatrix4(e.matrixWorld),this.union(Xu)}let s=e.children;for(let r=0,o=s.length;r<o;r++)this.expandByObject(s[r],t);return this}containsPoint(e){return e.x>=this.min.x&&e.x<=this.max.x&&e.y>=this.min.y&&e.y<=this.max.y&&e.z>=this.min.z&&e.z<=this.max.z}containsBox(e){return this.min.x<=e.min.x&&e.max.x<=this.max.x&&this.min.y<=e.min.y&&e.max.y<=this.max.y&&this.min.z<=e.min.z&&e.max.z<=this.max.z}getParameter(e,t){return t.set((e.x-this.min.x)/(this.max.x-this.min.x),(e.y-this.min.y)/(this.max.y-this.min.y),(e.z-this.min.z)/(this.max.z-this.min.z))}intersectsBox(e){return e.max.x>=this.min.x&&e.min.x<=this.max.x&&e.max.y>=this.min.y&&e.min.y<=this.max.y&&e.max.z>=this.min.z&&e.min.z<=this.max.z}intersectsSphere(e){return this.clampPoint(e.center,Ss),Ss.distanceToSquared(e.center)<=e.radius*e.radius}intersectsPlane(e){let t,i;return e.normal.x>0?(t=e.normal.x*this.min.x,i=e.normal.x*this.max.x):(t=e.normal.x*this.max.x,i=e.normal.x*this.min.x),e.normal.y>0?(t+=e.normal.y*this.min.y,i+=e.normal.y*this.max.y):(t+=e.normal.y*this.max.y,i+=e.normal.y*this.min.y),e.normal.z>0?(t+=e.normal.z*this.min.z,i+=e.normal.z*this.max.z):(t+=e.normal.z*this.max.z,i+=e.normal.z*this.min.z),t<=-e.constant&&i>=-e.constant}intersectsTriangle(e){if(this.isEmpty())return!1;this.getCenter(ic),qu.subVectors(this.max,ic),Ua.subVectors(e.a,ic),Oa.subVectors(e.b,ic),Fa.subVectors(e.c,ic),qr.subVectors(Oa,Ua),Yr.subVectors(Fa,Oa),Lo.subVectors(Ua,Fa);let t=[0,-qr.z,qr.y,0,-Yr.z,Yr.y,0,-Lo.z,Lo.y,qr.z,0,-qr.x,Yr.z,0,-Yr.x,Lo.z,0,-Lo.x,-qr.y,qr.x,0,-Yr.y,Yr.x,0,-Lo.y,Lo.x,0];return!Vp(t,Ua,Oa,Fa,qu)||(t=[1,0,0,0,1,0,0,0,1],!Vp(t,Ua,Oa,Fa,qu))?!1:(Yu.crossVectors(qr,Yr),t=[Yu.x,Yu.y,Yu.z],Vp(t,Ua,Oa,Fa,qu))}clampPoint(e,t){return t.copy(e).clamp(this.min,this.max)}distanceToPoint(e){return this.clampPoint(e,Ss).distanceTo(e)}getBoundingSphere(e){return this.isEmpty()?e.makeEmpty():(this.getCenter(e.center),e.radius=this.getSize(Ss).length()*.5),e}intersect(e){return this.min.max(e.min),this.max.min(e.max),this.isEmpty()&&this.makeEmpty(),this}union(e){return this.min.min(e.min),this.max.max(e.max),this}applyMatrix4(e){return this.isEmpty()?this:(mr[0].set(this.min.x,this.min.y,this.min.z).applyMatrix4(e),mr[1].set(this.min.x,this.min.y,this.max.z).applyMatrix4(e),mr[2].set(this.min.x,this.max.y,this.min.z).applyMatrix4(e),mr[3].set(this.min.x,this.max.y,this.max.z).applyMatrix4(e),mr[4].set(this.max.x,this.min.y,this.min.z).applyMatrix4(e),mr[5].set(this.max.x,this.min.y,this.max.z).applyMatrix4(e),mr[6].set(this.max.x,this.max.y,this.min.z).applyMatrix4(e),mr[7].set(this.max.x,this.max.y,this.max.z).applyMatrix4(e),this.setFromPoints(mr),this)}translate(e){return this.min.add(e),this.max.add(e),this}equals(e){return e.min.equals(this.min)&&e.max.equals(this.max)}toJSON(){return{min:this.min.toArray(),max:this.max.toArray()}}fromJSON(e){return this.min.fromArray(e.min),this.max.fromArray(e.max),this}},mr=[new B,new B,new B,new B,new B,new B,new B,new B],Ss=new B,Xu=new Fn,Ua=new B,Oa=new B,Fa=new B,qr=new B,Yr=new B,Lo=new B,ic=new B,qu=new B,Yu=new B,Do=new B;function Vp(n,e,t,i,s){for(let r=0,o=n.length-3;r<=o;r+=3){Do.fromArray(n,r);let a=s.x*Math.abs(Do.x)+s.y*Math.abs(Do.y)+s.z*Math.abs(Do.z),l=e.dot(Do),c=t.dot(Do),u=i.dot(Do);if(Math.max(-Math.max(l,c,u),Math.min(l,c,u))>a)return!1}return!0}var Cn=new B,ju=new at,gw=0,fn=class extends Hs{constructor(e,t,i=!1){if(super(),Array.isArray(e))throw new TypeError("THREE.BufferAttribute: array should be a Typed Array.");this.isBufferAttribute=!0,Object.defineProperty(this,"id",{value:gw++}),this.name="",this.array=e,this.itemSize=t,this.count=e!==void 0?e.length/t:0,this.normalized=i,this.usage=Tm,this.updateRanges=[],this.gpuType=Oi,this.version=0,this._normalizationScale=e!==void 0?Nd(e):void 0}onUploadCallback(){}set needsUpdate(e){e===!0&&this.version++}setUsage(e){return this.usage=e,this}addUpdateRange(e,t){this.updateRanges.push({start:e,count:t})}clearUpdateRanges(){this.updateRanges.length=0}copy(e){return this.name=e.name,this.array=new e.array.constructor(e.array),this.itemSize=e.itemSize,this.count=e.count,this.normalized=e.normalized,this.usage=e.usage,this.gpuType=e.gpuType,this._normalizationScale=e._normalizationScale,this}copyAt(e,t,i){e*=this.itemSize,i*=t.itemSize;for(let s=0,r=this.itemSize;s<r;s++)this.array[e+s]=t.array[i+s];return this}copyArray(e){return this.array.set(e),this}applyMatrix3(e){if(this.itemSize===2)for(let t=0,i=this.count;t<i;t++)ju.fromBufferAttribute(this,t),ju.applyMatrix3(e),this.setXY(t,ju.x,ju.y);else if(this.itemSize===3)for(let t=0,i=this.count;t<i;t++)Cn.fromBufferAttribute(this,t),Cn.applyMatrix3(e),this.setXYZ(t,Cn.x,Cn.y,Cn.z);return this}applyMatrix4(e){for(let t=0,i=this.count;t<i;t++)Cn.fromBufferAttribute(this,t),Cn.applyMatrix4(e),this.setXYZ(t,Cn.x,Cn.y,Cn.z);return this}applyNormalMatrix(e){for(let t=0,i=this.count;t<i;t++)Cn.fromBufferAttribute(this,t),Cn.applyNormalMatrix(e),this.setXYZ(t,Cn.x,Cn.y,Cn.z);return this}transformDirection(e){for(let t=0,i=this.count;t<i;t++)Cn.fromBufferAttribute(this,t),Cn.transformDirection(e),this.setXYZ(t,Cn.x,Cn.y,Cn.z);return this}set(e,t=0){return this.array.set(e,t),this}getComponent(e,t){let i=this.array[e*this.itemSize+t];return this.normalized&&(i=this._denormalize(i)),i}setComponent(e,t,i){return this.normalized&&(i=this._normalize(i)),this.array[e*this.itemSize+t]=i,this}getX(e){let t=this.array[e*this.itemSize];return this.normalized&&(t=this._denormalize(t)),t}setX(e,t){return this.normalized&&(t=this._normalize(t)),this.array[e*this.itemSize]=t,this}getY(e){let t=this.array[e*this.itemSize+1];return this.normalized&&(t=this._denormalize(t)),t}setY(e,t){return this.normalized&&(t=this._normalize(t)),this.array[e*this.itemSize+1]=t,this}getZ(e){let t=this.array[e*this.itemSize+2];return this.normalized&&(t=this._denormalize(t)),t}setZ(e,t){return this.normalized&&(t=this._normalize(t)),this.array[e*this.itemSize+2]=t,this}getW(e){let t=this.array[e*this.itemSize+3];return this.normalized&&(t=this._denormalize(t)),t}setW(e,t){return this.normalized&&(t=this._normalize(t)),this.array[e*this.itemSize+3]=t,this}setXY(e,t,i){return e*=this.itemSize,this.normalized&&(t=this._normalize(t),i=this._normalize(i)),this.array[e+0]=t,this.array[e+1]=i,this}setXYZ(e,t,i,s){return e*=this.itemSize,this.normalized&&(t=this._normalize(t),i=this._normalize(i),s=this._normalize(s)),this.array[e+0]=t,this.array[e+1]=i,this.array[e+2]=s,this}setXYZW(e,t,i,s,r){return e*=this.itemSize,this.normalized&&(t=this._normalize(t),i=this._normalize(i),s=this._normalize(s),r=this._normalize(r)),this.array[e+0]=t,this.array[e+1]=i,this.array[e+2]=s,this.array[e+3]=r,this}onUpload(e){return this.onUploadCallback=e,this}clone(){return new this.constructor(this.array,this.itemSize).copy(this)}toJSON(){let e={itemSize:this.itemSize,type:this.array.constructor.name,array:Array.from(this.array),normalized:this.normalized};return e.name=this.name,e.usage=this.usage,e.gpuType=this.gpuType,e}dispose(){this.dispatchEvent({type:"dispose"})}_denormalize(e){let t=this._normalizationScale;return t!==void 0?Math.max(e/t,-1):Rm(e,this.array)}_normalize(e){let t=this._normalizationScale;return t!==void 0?Math.round(e*t):Pm(e,this.array)}};var _c=class extends fn{constructor(e,t,i){super(new Uint16Array(e),t,i)}};var vc=class extends fn{constructor(e,t,i){super(new Uint32Array(e),t,i)}};var pn=class extends fn{constructor(e,t,i){super(new Float32Array(e),t,i)}},_w=new Fn,sc=new B,Hp=new B,Pn=class{constructor(e=new B,t=-1){this.isSphere=!0,this.center=e,this.radius=t}set(e,t){return this.center.copy(e),this.radius=t,this}setFromPoints(e,t){let i=this.center;t!==void 0?i.copy(t):_w.setFromPoints(e).getCenter(i);let s=0;for(let r=0,o=e.length;r<o;r++)s=Math.max(s,i.distanceToSquared(e[r]));return this.radius=Math.sqrt(s),this}copy(e){return this.center.copy(e.center),this.radius=e.radius,this}isEmpty(){return this.radius<0}makeEmpty(){return this.center.set(0,0,0),this.radius=-1,this}containsPoint(e){return e.distanceToSquared(this.center)<=this.radius*this.radius}distanceToPoint(e){return e.distanceTo(this.center)-this.radius}intersectsSphere(e){let t=this.radius+e.radius;return e.center.distanceToSquared(this.center)<=t*t}intersectsBox(e){return e.intersectsSphere(this)}intersectsPlane(e){return Math.abs(e.distanceToPoint(this.center))<=this.radius}clampPoint(e,t){let i=this.center.distanceToSquared(e);return t.copy(e),i>this.radius*this.radius&&(t.sub(this.center).normalize(),t.multiplyScalar(this.radius).add(this.center)),t}getBoundingBox(e){return this.isEmpty()?(e.makeEmpty(),e):(e.set(this.center,this.center),e.expandByScalar(this.radius),e)}applyMatrix4(e){return this.center.applyMatrix4(e),this.radius=this.radius*e.getMaxScaleOnAxis(),this}translate(e){return this.center.add(e),this}expandByPoint(e){if(this.isEmpty())return this.center.copy(e),this.radius=0,this;sc.subVectors(e,this.center);let t=sc.lengthSq();if(t>this.radius*this.radius){let i=Math.sqrt(t),s=(i-this.radius)*.5;this.center.addScaledVector(sc,s/i),this.radius+=s}return this}union(e){return e.isEmpty()?this:this.isEmpty()?(this.copy(e),this):(this.center.equals(e.center)===!0?this.radius=Math.max(this.radius,e.radius):(Hp.subVectors(e.center,this.center).setLength(e.radius),this.expandByPoint(sc.copy(e.center).add(Hp)),this.expandByPoint(sc.copy(e.center).sub(Hp))),this)}equals(e){return e.center.equals(this.center)&&e.radius===this.radius}clone(){return new this.constructor().copy(this)}toJSON(){return{radius:this.radius,center:this.center.toArray()}}fromJSON(e){return this.radius=e.radius,this.center.fromArray(e.center),this}},vw=0,ns=new ht,$p=new ti,Ba=new B,Wi=new Fn,rc=new Fn,jn=new B,Bn=class n extends Hs{constructor(){super(),this.isBufferGeometry=!0,Object.defineProperty(this,"id",{value:vw++}),this.uuid=io(),this.name="",this.type="BufferGeometry",this.index=null,this.indirect=null,this.indirectOffset=0,this.attributes={},this.morphAttributes={},this.morphTargetsRelative=!1,this.groups=[],this.boundingBox=null,this.boundingSphere=null,this.drawRange={start:0,count:1/0},this.userData={},this._transformed=!1}getIndex(){return this.index}setIndex(e){return Array.isArray(e)?this.index=new($M(e)?vc:_c)(e,1):this.index=e,this}setIndirect(e,t=0){return this.indirect=e,this.indirectOffset=t,this}getIndirect(){return this.indirect}getAttribute(e){return this.attributes[e]}setAttribute(e,t){return this.attributes[e]=t,this}deleteAttribute(e){return delete this.attributes[e],this}hasAttribute(e){return this.attributes[e]!==void 0}addGroup(e,t,i=0){this.groups.push({start:e,count:t,materialIndex:i})}clearGroups(){this.groups=[]}setDrawRange(e,t){this.drawRange.start=e,this.drawRange.count=t}applyMatrix4(e){let t=this.attributes.position;t!==void 0&&(t.applyMatrix4(e),t.needsUpdate=!0);let i=this.attributes.normal;if(i!==void 0){let r=new nt().getNormalMatrix(e);i.applyNormalMatrix(r),i.needsUpdate=!0}let s=this.attributes.tangent;return s!==void 0&&(s.transformDirection(e),s.needsUpdate=!0),this.boundingBox!==null&&this.computeBoundingBox(),this.boundingSphere!==null&&this.computeBoundingSphere(),this._transformed=!0,this}applyQuaternion(e){return ns.makeRotationFromQuaternion(e),this.applyMatrix4(ns),this}rotateX(e){return ns.makeRotationX(e),this.applyMatrix4(ns),this}rotateY(e){return ns.makeRotationY(e),this.applyMatrix4(ns),this}rotateZ(e){return ns.makeRotationZ(e),this.applyMatrix4(ns),this}translate(e,t,i){return ns.makeTranslation(e,t,i),this.applyMatrix4(ns),this}scale(e,t,i){return ns.makeScale(e,t,i),this.applyMatrix4(ns),this}lookAt(e){return $p.lookAt(e),$p.updateMatrix(),this.applyMatrix4($p.matrix),this}center(){return this.computeBoundingBox(),this.boundingBox.getCenter(Ba).negate(),this.translate(Ba.x,Ba.y,Ba.z),this}setFromPoints(e){let t=this.getAttribute("position");if(t===void 0){let i=[];for(let s=0,r=e.length;s<r;s++){let o=e[s];i.push(o.x,o.y,o.z||0)}this.setAttribute("position",new pn(i,3))}else{let i=Math.min(e.length,t.count);for(let s=0;s<i;s++){let r=e[s];t.setXYZ(s,r.x,r.y,r.z||0)}e.length>t.count&&Ze("BufferGeometry: Buffer size too small for points data. Use .dispose() and create a new geometry."),t.needsUpdate=!0}return this}computeBoundingBox(){this.boundingBox===null&&(this.boundingBox=new Fn);let e=this.attributes.position,t=this.morphAttributes.position;if(e&&e.isGLBufferAttribute){tt("BufferGeometry.computeBoundingBox(): GLBufferAttribute requires a manual bounding box.",this),this.boundingBox.set(new B(-1/0,-1/0,-1/0),new B(1/0,1/0,1/0));return}if(e!==void 0){if(this.boundingBox.setFromBufferAttribute(e),t)for(let i=0,s=t.length;i<s;i++){let r=t[i];Wi.setFromBufferAttribute(r),this.morphTargetsRelative?(jn.addVectors(this.boundingBox.min,Wi.min),this.boundingBox.expandByPoint(jn),jn.addVectors(this.boundingBox.max,Wi.max),this.boundingBox.expandByPoint(jn)):(this.boundingBox.expandByPoint(Wi.min),this.boundingBox.expandByPoint(Wi.max))}}else this.boundingBox.makeEmpty();(isNaN(this.boundingBox.min.x)||isNaN(this.boundingBox.min.y)||isNaN(this.boundingBox.min.z))&&tt('BufferGeometry.computeBoundingBox(): Computed min/max have NaN values. The "position" attribute is likely to have NaN values.',this)}computeBoundingSphere(){this.boundingSphere===null&&(this.boundingSphere=new Pn);let e=this.attributes.position,t=this.morphAttributes.position;if(e&&e.isGLBufferAttribute){tt("BufferGeometry.computeBoundingSphere(): GLBufferAttribute requires a manual bounding sphere.",this),this.boundingSphere.set(new B,1/0);return}if(e){let i=this.boundingSphere.center;if(Wi.setFromBufferAttribute(e),t)for(let r=0,o=t.length;r<o;r++){let a=t[r];rc.setFromBufferAttribute(a),this.morphTargetsRelative?(jn.addVectors(Wi.min,rc.min),Wi.expandByPoint(jn),jn.addVectors(Wi.max,rc.max),Wi.expandByPoint(jn)):(Wi.expandByPoint(rc.min),Wi.expandByPoint(rc.max))}Wi.getCenter(i);let s=0;for(let r=0,o=e.count;r<o;r++)jn.fromBufferAttribute(e,r),s=Math.max(s,i.distanceToSquared(jn));if(t)for(let r=0,o=t.length;r<o;r++){let a=t[r],l=this.morphTargetsRelative;for(let c=0,u=a.count;c<u;c++)jn.fromBufferAttribute(a,c),l&&(Ba.fromBufferAttribute(e,c),jn.add(Ba)),s=Math.max(s,i.distanceToSquared(jn))}this.boundingSphere.radius=Math.sqrt(s),isNaN(this.boundingSphere.radius)&&tt('BufferGeometry.computeBoundingSphere(): Computed radius is NaN. The "position" attribute is likely to have NaN values.',this)}}computeTangents(){let e=this.index,t=this.attributes;if(e===null||t.position===void 0||t.normal===void 0||t.uv===void 0){tt("BufferGeometry: .computeTangents() failed. Missing required attributes (index, position, normal or uv)");return}let i=t.position,s=t.normal,r=t.uv,o=this.getAttribute("tangent");(o===void 0||o.count!==i.count)&&(o=new fn(new Float32Array(4*i.count),4),this.setAttribute("tangent",o));let a=[],l=[],c=new Uint8Array(i.count);for(let k=0;k<i.count;k++)a[k]=new B,l[k]=new B;let u=new B,h=new B,d=new B,f=new at,m=new at,y=new at,g=new B,p=new B;function x(k,U,I){c[k]=c[U]=c[I]=1,u.fromBufferAttribute(i,k),h.fromBufferAttribute(i,U),d.fromBufferAttribute(i,I),f.fromBufferAttribute(r,k),m.fromBufferAttribute(r,U),y.fromBufferAttribute(r,I),h.sub(u),d.sub(u),m.sub(f),y.sub(f);let z=1/(m.x*y.y-y.x*m.y);isFinite(z)&&(g.copy(h).multiplyScalar(y.y).addScaledVector(d,-m.y).multiplyScalar(z),p.copy(d).multiplyScalar(m.x).addScaledVector(h,-y.x).multiplyScalar(z),a[k].add(g),a[U].add(g),a[I].add(g),l[k].add(p),l[U].add(p),l[I].add(p))}let T=this.groups;T.length===0&&(T=[{start:0,count:e.count}]);for(let k=0,U=T.length;k<U;++k){let I=T[k],z=I.start,H=I.count;for(let N=z,G=z+H;N<G;N+=3)x(e.getX(N+0),e.getX(N+1),e.getX(N+2))}let b=new B,R=new B,A=new B,v=new B;function E(k){A.fromBufferAttribute(s,k),v.copy(A);let U=a[k];b.copy(U),b.sub(A.multiplyScalar(A.dot(U))).normalize(),R.crossVectors(v,U);let z=R.dot(l[k])<0?-1:1;o.setXYZW(k,b.x,b.y,b.z,z)}for(let k=0,U=i.count;k<U;++k)c[k]&&E(k);this._transformed=!0}computeVertexNormals(){let e=this.index,t=this.getAttribute("position");if(t!==void 0){let i=this.getAttribute("normal");if(i===void 0||i.count!==t.count)i=new fn(new Float32Array(t.count*3),3),this.setAttribute("normal",i);else for(let d=0,f=i.count;d<f;d++)i.setXYZ(d,0,0,0);let s=new B,r=new B,o=new B,a=new B,l=new B,c=new B,u=new B,h=new B;if(e)for(let d=0,f=e.count;d<f;d+=3){let m=e.getX(d+0),y=e.getX(d+1),g=e.getX(d+2);s.fromBufferAttribute(t,m),r.fromBufferAttribute(t,y),o.fromBufferAttribute(t,g),u.subVectors(o,r),h.subVectors(s,r),u.cross(h),a.fromBufferAttribute(i,m),l.fromBufferAttribute(i,y),c.fromBufferAttribute(i,g),a.add(u),l.add(u),c.add(u),i.setXYZ(m,a.x,a.y,a.z),i.setXYZ(y,l.x,l.y,l.z),i.setXYZ(g,c.x,c.y,c.z)}else for(let d=0,f=t.count;d<f;d+=3)s.fromBufferAttribute(t,d+0),r.fromBufferAttribute(t,d+1),o.fromBufferAttribute(t,d+2),u.subVectors(o,r),h.subVectors(s,r),u.cross(h),i.setXYZ(d+0,u.x,u.y,u.z),i.setXYZ(d+1,u.x,u.y,u.z),i.setXYZ(d+2,u.x,u.y,u.z);this.normalizeNormals(),i.needsUpdate=!0}}normalizeNormals(){let e=this.attributes.normal;for(let t=0,i=e.count;t<i;t++)jn.fromBufferAttribute(e,t),jn.normalize(),e.setXYZ(t,jn.x,jn.y,jn.z)}toNonIndexed(){function e(a,l){let c=a.array,u=a.itemSize,h=a.normalized,d=new c.constructor(l.length*u),f=0,m=0;for(let y=0,g=l.length;y<g;y++){a.isInterleavedBufferAttribute?f=l[y]*a.data.stride+a.offset:f=l[y]*u;for(let p=0;p<u;p++)d[m++]=c[f++]}return new fn(d,u,h)}if(this.index===null)return Ze("BufferGeometry.toNonIndexed(): BufferGeometry is already non-indexed."),this;let t=new n,i=this.index.array,s=this.attributes;for(let a in s){let l=s[a],c=e(l,i);t.setAttribute(a,c)}let r=this.morphAttributes;for(let a in r){let l=[],c=r[a];for(let u=0,h=c.length;u<h;u++){let d=c[u],f=e(d,i);l.push(f)}t.morphAttributes[a]=l}t.morphTargetsRelative=this.morphTargetsRelative;let o=this.groups;for(let a=0,l=o.length;a<l;a++){let c=o[a];t.addGroup(c.start,c.count,c.materialIndex)}return t}toJSON(){let e={metadata:{version:4.7,type:"BufferGeometry",generator:"BufferGeometry.toJSON"}};if(e.uuid=this.uuid,e.type=this.parameters!==void 0&&this._transformed===!0?"BufferGeometry":this.type,e.name=this.name,Object.keys(this.userData).length>0&&(e.userData=this.userData),this.parameters!==void 0&&this._transformed!==!0){let l=this.parameters;for(let c in l)l[c]!==void 0&&(e[c]=l[c]);return e}e.data={attributes:{}};let t=this.index;t!==null&&(e.data.index={type:t.array.constructor.name,array:Array.prototype.slice.call(t.array)});let i=this.attributes;for(let l in i){let c=i[l];e.data.attributes[l]=c.toJSON(e.data)}let s={},r=!1;for(let l in this.morphAttributes){let c=this.morphAttributes[l],u=[];for(let h=0,d=c.length;h<d;h++){let f=c[h];u.push(f.toJSON(e.data))}u.length>0&&(s[l]=u,r=!0)}r&&(e.data.morphAttributes=s,e.data.morphTargetsRelative=this.morphTargetsRelative);let o=this.groups;o.length>0&&(e.data.groups=JSON.parse(JSON.stringify(o)));let a=this.boundingSphere;return a!==null&&(e.data.boundingSphere=a.toJSON()),e}clone(){return new this.constructor().copy(this)}copy(e){this.index=null,this.attributes={},this.morphAttributes={},this.groups=[],this.boundingBox=null,this.boundingSphere=null;let t={};this.name=e.name;let i=e.index;i!==null&&this.setIndex(i.clone());let s=e.attributes;for(let c in s){let u=s[c];this.setAttribute(c,u.clone(t))}let r=e.morphAttributes;for(let c in r){let u=[],h=r[c];for(let d=0,f=h.length;d<f;d++)u.push(h[d].clone(t));this.morphAttributes[c]=u}this.morphTargetsRelative=e.morphTargetsRelative;let o=e.groups;for(let c=0,u=o.length;c<u;c++){let h=o[c];this.addGroup(h.start,h.count,h.materialIndex)}let a=e.boundingBox;a!==null&&(this.boundingBox=a.clone());let l=e.boundingSphere;return l!==null&&(this.boundingSphere=l.clone()),this.drawRange.start=e.drawRange.start,this.drawRange.count=e.drawRange.count,this.userData=e.userData,this._transformed=e._transformed,this}dispose(){this.dispatchEvent({type:"dispose"})}},Ah=class{constructor(e,t){this.isInterleavedBuffer=!0,this.array=e,this.stride=t,this.count=e!==void 0?e.length/t:0,this.usage=Tm,this.updateRanges=[],this.version=0,this.uuid=io()}onUploadCallback(){}set needsUpdate(e){e===!0&&this.version++}setUsage(e){return this.usage=e,this}addUpdateRange(e,t){this.updateRanges.push({start:e,count:t})}clearUpdateRanges(){this.updateRanges.length=0}copy(e){return this.array=new e.array.constructor(e.array),this.count=e.count,this.stride=e.stride,this.usage=e.usage,this}copyAt(e,t,i){e*=this.stride,i*=t.stride;for(let s=0,r=this.stride;s<r;s++)this.array[e+s]=t.array[i+s];return this}set(e,t=0){return this.array.set(e,t),this}clone(e){e.arrayBuffers===void 0&&(e.arrayBuffers={});let t=P_(this.array);e.arrayBuffers[t]===void 0&&(e.arrayBuffers[t]=this.array.slice(0).buffer);let i=new this.array.constructor(e.arrayBuffers[t]),s=new this.constructor(i,this.stride);return s.setUsage(this.usage),s}onUpload(e){return this.onUploadCallback=e,this}toJSON(e){e.arrayBuffers===void 0&&(e.arrayBuffers={});let t=P_(this.array);e.arrayBuffers[t]===void 0&&(e.arrayBuffers[t]=Array.from(new Uint32Array(this.array.slice(0).buffer)));let i={uuid:this.uuid,buffer:t,type:this.array.constructor.name,stride:this.stride};return i.usage=this.usage,i}};function P_(n){return n.buffer._uuid===void 0&&(n.buffer._uuid=io()),n.byteOffset===0&&n.byteLength===n.buffer.byteLength?n.buffer._uuid:n.buffer._uuid+":"+n.byteOffset+":"+n.byteLength}var wi=new B,ws=class n{constructor(e,t,i,s=!1){this.isInterleavedBufferAttribute=!0,this.name="",this.data=e,this.itemSize=t,this.offset=i,this.normalized=s,this._normalizationScale=e!==void 0?Nd(e.array):void 0}get count(){return this.data.count}get array(){return this.data.array}set needsUpdate(e){this.data.needsUpdate=e}applyMatrix4(e){for(let t=0,i=this.data.count;t<i;t++)wi.fromBufferAttribute(this,t),wi.applyMatrix4(e),this.setXYZ(t,wi.x,wi.y,wi.z);return this}applyNormalMatrix(e){for(let t=0,i=this.count;t<i;t++)wi.fromBufferAttribute(this,t),wi.applyNormalMatrix(e),this.setXYZ(t,wi.x,wi.y,wi.z);return this}transformDirection(e){for(let t=0,i=this.count;t<i;t++)wi.fromBufferAttribute(this,t),wi.transformDirection(e),this.setXYZ(t,wi.x,wi.y,wi.z);return this}getComponent(e,t){let i=this.array[e*this.data.stride+this.offset+t];return this.normalized&&(i=this._denormalize(i)),i}setComponent(e,t,i){return this.normalized&&(i=this._normalize(i)),this.data.array[e*this.data.stride+this.offset+t]=i,this}setX(e,t){return this.normalized&&(t=this._normalize(t)),this.data.array[e*this.data.stride+this.offset]=t,this}setY(e,t){return this.normalized&&(t=this._normalize(t)),this.data.array[e*this.data.stride+this.offset+1]=t,this}setZ(e,t){return this.normalized&&(t=this._normalize(t)),this.data.array[e*this.data.stride+this.offset+2]=t,this}setW(e,t){return this.normalized&&(t=this._normalize(t)),this.data.array[e*this.data.stride+this.offset+3]=t,this}getX(e){let t=this.data.array[e*this.data.stride+this.offset];return this.normalized&&(t=this._denormalize(t)),t}getY(e){let t=this.data.array[e*this.data.stride+this.offset+1];return this.normalized&&(t=this._denormalize(t)),t}getZ(e){let t=this.data.array[e*this.data.stride+this.offset+2];return this.normalized&&(t=this._denormalize(t)),t}getW(e){let t=this.data.array[e*this.data.stride+this.offset+3];return this.normalized&&(t=this._denormalize(t)),t}setXY(e,t,i){return e=e*this.data.stride+this.offset,this.normalized&&(t=this._normalize(t),i=this._normalize(i)),this.data.array[e+0]=t,this.data.array[e+1]=i,this}setXYZ(e,t,i,s){return e=e*this.data.stride+this.offset,this.normalized&&(t=this._normalize(t),i=this._normalize(i),s=this._normalize(s)),this.data.array[e+0]=t,this.data.array[e+1]=i,this.data.array[e+2]=s,this}setXYZW(e,t,i,s,r){return e=e*this.data.stride+this.offset,this.normalized&&(t=this._normalize(t),i=this._normalize(i),s=this._normalize(s),r=this._normalize(r)),this.data.array[e+0]=t,this.data.array[e+1]=i,this.data.array[e+2]=s,this.data.array[e+3]=r,this}clone(e){if(e===void 0){pc("InterleavedBufferAttribute.clone(): Cloning an interleaved buffer attribute will de-interleave buffer data.");let t=[];for(let i=0;i<this.count;i++){let s=i*this.data.stride+this.offset;for(let r=0;r<this.itemSize;r++)t.push(this.data.array[s+r])}return new fn(new this.array.constructor(t),this.itemSize,this.normalized)}else return e.interleavedBuffers===void 0&&(e.interleavedBuffers={}),e.interleavedBuffers[this.data.uuid]===void 0&&(e.interleavedBuffers[this.data.uuid]=this.data.clone(e)),new n(e.interleavedBuffers[this.data.uuid],this.itemSize,this.offset,this.normalized)}toJSON(e){if(e===void 0){pc("InterleavedBufferAttribute.toJSON(): Serializing an interleaved buffer attribute will de-interleave buffer data.");let t=[];for(let i=0;i<this.count;i++){let s=i*this.data.stride+this.offset;for(let r=0;r<this.itemSize;r++)t.push(this.data.array[s+r])}return{itemSize:this.itemSize,type:this.array.constructor.name,array:t,normalized:this.normalized}}else return e.interleavedBuffers===void 0&&(e.interleavedBuffers={}),e.interleavedBuffers[this.data.uuid]===void 0&&(e.interleavedBuffers[this.data.uuid]=this.data.toJSON(e)),{isInterleavedBufferAttribute:!0,itemSize:this.itemSize,data:this.data.uuid,offset:this.offset,normalized:this.normalized}}_denormalize(e){let t=this._normalizationScale;return t!==void 0?Math.max(e/t,-1):Rm(e,this.data.array)}_normalize(e){let t=this._normalizationScale;return t!==void 0?Math.round(e*t):Pm(e,this.data.array)}},Gp=new B,yw=new B,xw=new nt,Ms=class{constructor(e=new B(1,0,0),t=0){this.isPlane=!0,this.normal=e,this.constant=t}set(e,t){return this.normal.copy(e),this.constant=t,this}setComponents(e,t,i,s){return this.normal.set(e,t,i),this.constant=s,this}setFromNormalAndCoplanarPoint(e,t){return this.normal.copy(e),this.constant=-t.dot(this.normal),this}setFromCoplanarPoints(e,t,i){let s=Gp.subVectors(i,t).cross(yw.subVectors(e,t)).normalize();return this.setFromNormalAndCoplanarPoint(s,e),this}copy(e){return this.normal.copy(e.normal),this.constant=e.constant,this}normalize(){let e=1/this.normal.length();return this.normal.multiplyScalar(e),this.constant*=e,this}negate(){return this.constant*=-1,this.normal.negate(),this}distanceToPoint(e){return this.normal.dot(e)+this.constant}distanceToSphere(e){return this.distanceToPoint(e.center)-e.radius}projectPoint(e,t){return t.copy(e).addScaledVector(this.normal,-this.distanceToPoint(e))}intersectLine(e,t,i=!0){let s=e.delta(Gp),r=this.normal.dot(s);if(r===0)return this.distanceToPoint(e.start)===0?t.copy(e.start):null;let o=-(e.start.dot(this.normal)+this.constant)/r;return i===!0&&(o<0||o>1)?null:t.copy(e.start).addScaledVector(s,o)}intersectsLine(e){let t=this.distanceToPoint(e.start),i=this.distanceToPoint(e.end);return t<0&&i>0||i<0&&t>0}intersectsBox(e){return e.intersectsPlane(this)}intersectsSphere(e){return e.intersectsPlane(this)}coplanarPoint(e){return e.copy(this.normal).multiplyScalar(-this.constant)}applyMatrix4(e,t){let i=t||xw.getNormalMatrix(e),s=this.coplanarPoint(Gp).applyMatrix4(e),r=this.normal.applyMatrix3(i).normalize();return this.constant=-s.dot(r),this}translate(e){return this.constant-=e.dot(this.normal),this}equals(e){return e.normal.equals(this.normal)&&e.constant===this.constant}clone(){return new this.constructor().copy(this)}toJSON(){return{normal:this.normal.toArray(),constant:this.constant}}fromJSON(e){return this.normal.fromArray(e.normal),this.constant=e.constant,this}},bw=0,xr=class extends Hs{constructor(){super(),this.isMaterial=!0,Object.defineProperty(this,"id",{value:bw++}),this.uuid=io(),this.name="",this.type="Material",this.blending=il,this.side=to,this.vertexColors=!1,this.opacity=1,this.transparent=!1,this.alphaHash=!1,this.blendSrc=am,this.blendDst=lm,this.blendEquation=Ho,this.blendSrcAlpha=null,this.blendDstAlpha=null,this.blendEquationAlpha=null,this.blendColor=new lt(0,0,0),this.blendAlpha=0,this.depthFunc=qa,this.depthTest=!0,this.depthWrite=!0,this.stencilWriteMask=255,this.stencilFunc=xv,this.stencilRef=0,this.stencilFuncMask=255,this.stencilFail=ph,this.stencilZFail=ph,this.stencilZPass=ph,this.stencilWrite=!1,this.clippingPlanes=null,this.clipIntersection=!1,this.clipShadows=!1,this.shadowSide=null,this.colorWrite=!0,this.precision=null,this.polygonOffset=!1,this.polygonOffsetFactor=0,this.polygonOffsetUnits=0,this.dithering=!1,this.alphaToCoverage=!1,this.premultipliedAlpha=!1,this.forceSinglePass=!1,this.allowOverride=!0,this.visible=!0,this.toneMapped=!0,this.userData={},this.version=0,this._alphaTest=0}get alphaTest(){return this._alphaTest}set alphaTest(e){this._alphaTest>0!=e>0&&this.version++,this._alphaTest=e}onBeforeRender(){}onBeforeCompile(){}customProgramCacheKey(){return this.onBeforeCompile.toString()}setValues(e){if(e!==void 0)for(let t in e){let i=e[t];if(i===void 0){Ze(`Material: parameter '${t}' has value of undefined.`);continue}let s=this[t];if(s===void 0){Ze(`Material: '${t}' is not a property of THREE.${this.type}.`);continue}s&&s.isColor?s.set(i):s&&s.isVector2&&i&&i.isVector2||s&&s.isEuler&&i&&i.isEuler||s&&s.isVector3&&i&&i.isVector3?s.copy(i):this[t]=i}}toJSON(e){let t=e===void 0||typeof e=="string";t&&(e={textures:{},images:{}});let i={metadata:{version:4.7,type:"Material",generator:"Material.toJSON"}};i.uuid=this.uuid,i.type=this.type,i.blending=this.blending,i.side=this.side,i.shadowSide=this.shadowSide,i.vertexColors=this.vertexColors,i.opacity=this.opacity,i.transparent=this.transparent,i.blendSrc=this.blendSrc,i.blendDst=this.blendDst,i.blendEquation=this.blendEquation,i.blendSrcAlpha=this.blendSrcAlpha,i.blendDstAlpha=this.blendDstAlpha,i.blendEquationAlpha=this.blendEquationAlpha,i.blendColor=this.blendColor.getHex(),i.blendAlpha=this.blendAlpha,i.depthFunc=this.depthFunc,i.depthTest=this.depthTest,i.depthWrite=this.depthWrite,i.colorWrite=this.colorWrite,i.clipIntersection=this.clipIntersection,i.clipShadows=this.clipShadows,i.stencilWriteMask=this.stencilWriteMask,i.stencilFunc=this.stencilFunc,i.stencilRef=this.stencilRef,i.stencilFuncMask=this.stencilFuncMask,i.stencilFail=this.stencilFail,i.stencilZFail=this.stencilZFail,i.stencilZPass=this.stencilZPass,i.stencilWrite=this.stencilWrite,i.polygonOffset=this.polygonOffset,i.polygonOffsetFactor=this.polygonOffsetFactor,i.polygonOffsetUnits=this.polygonOffsetUnits,i.dithering=this.dithering,i.alphaTest=this.alphaTest,i.alphaHash=this.alphaHash,i.alphaToCoverage=this.alphaToCoverage,i.premultipliedAlpha=this.premultipliedAlpha,i.forceSinglePass=this.forceSinglePass,i.allowOverride=this.allowOverride,i.visible=this.visible,i.toneMapped=this.toneMapped,i.name=this.name,this.color&&this.color.isColor&&(i.color=this.color.getHex()),this.roughness!==void 0&&(i.roughness=this.roughness),this.metalness!==void 0&&(i.metalness=this.metalness),this.sheen!==void 0&&(i.sheen=this.sheen),this.sheenColor&&this.sheenColor.isColor&&(i.sheenColor=this.sheenColor.getHex()),this.sheenRoughness!==void 0&&(i.sheenRoughness=this.sheenRoughness),this.emissive&&this.emissive.isColor&&(i.emissive=this.emissive.getHex()),this.emissiveIntensity!==void 0&&(i.emissiveIntensity=this.emissiveIntensity),this.specular&&this.specular.isColor&&(i.specular=this.specular.getHex()),this.specularIntensity!==void 0&&(i.specularIntensity=this.specularIntensity),this.specularColor&&this.specularColor.isColor&&(i.specularColor=this.specularColor.getHex()),this.shininess!==void 0&&(i.shininess=this.shininess),this.clearcoat!==void 0&&(i.clearcoat=this.clearcoat),this.clearcoatRoughness!==void 0&&(i.clearcoatRoughness=this.clearcoatRoughness),this.diffuseRoughness!==void 0&&(i.diffuseRoughness=this.diffuseRoughness),this.diffuseRoughnessMap&&this.diffuseRoughnessMap.isTexture&&(i.diffuseRoughnessMap=this.diffuseRoughnessMap.toJSON(e).uuid),this.clearcoatMap&&this.clearcoatMap.isTexture&&(i.clearcoatMap=this.clearcoatMap.toJSON(e).uuid),this.clearcoatRoughnessMap&&this.clearcoatRoughnessMap.isTexture&&(i.clearcoatRoughnessMap=this.clearcoatRoughnessMap.toJSON(e).uuid),this.clearcoatNormalMap&&this.clearcoatNormalMap.isTexture&&(i.clearcoatNormalMap=this.clearcoatNormalMap.toJSON(e).uuid,i.clearcoatNormalScale=this.clearcoatNormalScale.toArray()),this.sheenColorMap&&this.sheenColorMap.isTexture&&(i.sheenColorMap=this.sheenColorMap.toJSON(e).uuid),this.sheenRoughnessMap&&this.sheenRoughnessMap.isTexture&&(i.sheenRoughnessMap=this.sheenRoughnessMap.toJSON(e).uuid),this.dispersion!==void 0&&(i.dispersion=this.dispersion),this.retroreflectivity!==void 0&&(i.retroreflectivity=this.retroreflectivity),this.iridescence!==void 0&&(i.iridescence=this.iridescence),this.iridescenceIOR!==void 0&&(i.iridescenceIOR=this.iridescenceIOR),this.iridescenceThicknessMinimum!==void 0&&(i.iridescenceThicknessMinimum=this.iridescenceThicknessMinimum),this.iridescenceThicknessMaximum!==void 0&&(i.iridescenceThicknessMaximum=this.iridescenceThicknessMaximum),this.iridescenceMap&&this.iridescenceMap.isTexture&&(i.iridescenceMap=this.iridescenceMap.toJSON(e).uuid),this.iridescenceThicknessMap&&this.iridescenceThicknessMap.isTexture&&(i.iridescenceThicknessMap=this.iridescenceThicknessMap.toJSON(e).uuid),this.anisotropy!==void 0&&(i.anisotropy=this.anisotropy),this.anisotropyRotation!==void 0&&(i.anisotropyRotation=this.anisotropyRotation),this.anisotropyMap&&this.anisotropyMap.isTexture&&(i.anisotropyMap=this.anisotropyMap.toJSON(e).uuid),this.map&&this.map.isTexture&&(i.map=this.map.toJSON(e).uuid),this.matcap&&this.matcap.isTexture&&(i.matcap=this.matcap.toJSON(e).uuid),this.alphaMap&&this.alphaMap.isTexture&&(i.alphaMap=this.alphaMap.toJSON(e).uuid),this.lightMap&&this.lightMap.isTexture&&(i.lightMap=this.lightMap.toJSON(e).uuid,i.lightMapIntensity=this.lightMapIntensity),this.aoMap&&this.aoMap.isTexture&&(i.aoMap=this.aoMap.toJSON(e).uuid,i.aoMapIntensity=this.aoMapIntensity),this.bumpMap&&this.bumpMap.isTexture&&(i.bumpMap=this.bumpMap.toJSON(e).uuid,i.bumpScale=this.bumpScale),this.normalMap&&this.normalMap.isTexture&&(i.normalMap=this.normalMap.toJSON(e).uuid,i.normalMapType=this.normalMapType,i.normalScale=this.normalScale.toArray()),this.displacementMap&&this.displacementMap.isTexture&&(i.displacementMap=this.displacementMap.toJSON(e).uuid,i.displacementScale=this.displacementScale,i.displacementBias=this.displacementBias),this.roughnessMap&&this.roughnessMap.isTexture&&(i.roughnessMap=this.roughnessMap.toJSON(e).uuid),this.metalnessMap&&this.metalnessMap.isTexture&&(i.metalnessMap=this.metalnessMap.toJSON(e).uuid),this.emissiveMap&&this.emissiveMap.isTexture&&(i.emissiveMap=this.emissiveMap.toJSON(e).uuid),this.specularMap&&this.specularMap.isTexture&&(i.specularMap=this.specularMap.toJSON(e).uuid),this.specularIntensityMap&&this.specularIntensityMap.isTexture&&(i.specularIntensityMap=this.specularIntensityMap.toJSON(e).uuid),this.specularColorMap&&this.specularColorMap.isTexture&&(i.specularColorMap=this.specularColorMap.toJSON(e).uuid),this.envMap&&this.envMap.isTexture&&(i.envMap=this.envMap.toJSON(e).uuid,this.combine!==void 0&&(i.combine=this.combine)),this.envMapRotation!==void 0&&(i.envMapRotation=this.envMapRotation.toArray()),this.envMapIntensity!==void 0&&(i.envMapIntensity=this.envMapIntensity),this.reflectivity!==void 0&&(i.reflectivity=this.reflectivity),this.refractionRatio!==void 0&&(i.refractionRatio=this.refractionRatio),this.gradientMap&&this.gradientMap.isTexture&&(i.gradientMap=this.gradientMap.toJSON(e).uuid),this.transmission!==void 0&&(i.transmission=this.transmission),this.transmissionMap&&this.transmissionMap.isTexture&&(i.transmissionMap=this.transmissionMap.toJSON(e).uuid),this.thickness!==void 0&&(i.thickness=this.thickness),this.thicknessMap&&this.thicknessMap.isTexture&&(i.thicknessMap=this.thicknessMap.toJSON(e).uuid),this.attenuationDistance!==void 0&&(i.attenuationDistance=this.attenuationDistance),this.attenuationColor!==void 0&&(i.attenuationColor=this.attenuationColor.getHex()),this.size!==void 0&&(i.size=this.size),this.sizeAttenuation!==void 0&&(i.sizeAttenuation=this.sizeAttenuation),Array.isArray(this.clippingPlanes)&&this.clippingPlanes.length>0&&(i.clippingPlanes=this.clippingPlanes.map(r=>r.toJSON())),this.rotation!==void 0&&(i.rotation=this.rotation),this.depthPacking!==void 0&&(i.depthPacking=this.depthPacking),this.linewidth!==void 0&&(i.linewidth=this.linewidth),this.linecap!==void 0&&(i.linecap=this.linecap),this.linejoin!==void 0&&(i.linejoin=this.linejoin),this.dashSize!==void 0&&(i.dashSize=this.dashSize),this.gapSize!==void 0&&(i.gapSize=this.gapSize),this.scale!==void 0&&(i.scale=this.scale),this.wireframe!==void 0&&(i.wireframe=this.wireframe),this.wireframeLinewidth!==void 0&&(i.wireframeLinewidth=this.wireframeLinewidth),this.wireframeLinecap!==void 0&&(i.wireframeLinecap=this.wireframeLinecap),this.wireframeLinejoin!==void 0&&(i.wireframeLinejoin=this.wireframeLinejoin),this.flatShading!==void 0&&(i.flatShading=this.flatShading),this.fog!==void 0&&(i.fog=this.fog),Object.keys(this.userData).length>0&&(i.userData=this.userData);function s(r){let o=[];for(let a in r){let l=r[a];delete l.metadata,o.push(l)}return o}if(t){let r=s(e.textures),o=s(e.images);r.length>0&&(i.textures=r),o.length>0&&(i.images=o)}return i}fromJSON(e,t){if(e.uuid!==void 0&&(this.uuid=e.uuid),e.name!==void 0&&(this.name=e.name),e.color!==void 0&&this.color!==void 0&&this.color.setHex(e.color),e.roughness!==void 0&&(this.roughness=e.roughness),e.metalness!==void 0&&(this.metalness=e.metalness),e.sheen!==void 0&&(this.sheen=e.sheen),e.sheenColor!==void 0&&(this.sheenColor=new lt().setHex(e.sheenColor)),e.sheenRoughness!==void 0&&(this.sheenRoughness=e.sheenRoughness),e.emissive!==void 0&&this.emissive!==void 0&&this.emissive.setHex(e.emissive),e.specular!==void 0&&this.specular!==void 0&&this.specular.setHex(e.specular),e.specularIntensity!==void 0&&(this.specularIntensity=e.specularIntensity),e.specularColor!==void 0&&this.specularColor!==void 0&&this.specularColor.setHex(e.specularColor),e.shininess!==void 0&&(this.shininess=e.shininess),e.clearcoat!==void 0&&(this.clearcoat=e.clearcoat),e.clearcoatRoughness!==void 0&&(this.clearcoatRoughness=e.clearcoatRoughness),e.diffuseRoughness!==void 0&&(this.diffuseRoughness=e.diffuseRoughness),e.dispersion!==void 0&&(this.dispersion=e.dispersion),e.retroreflectivity!==void 0&&(this.retroreflectivity=e.retroreflectivity),e.iridescence!==void 0&&(this.iridescence=e.iridescence),e.iridescenceIOR!==void 0&&(this.iridescenceIOR=e.iridescenceIOR),e.iridescenceThicknessMinimum!==void 0&&(this.iridescenceThicknessMinimum=e.iridescenceThicknessMinimum),e.iridescenceThicknessMaximum!==void 0&&(this.iridescenceThicknessMaximum=e.iridescenceThicknessMaximum),e.iridescenceThicknessRange!==void 0&&(this.iridescenceThicknessMinimum=e.iridescenceThicknessRange[0],this.iridescenceThicknessMaximum=e.iridescenceThicknessRange[1]),e.transmission!==void 0&&(this.transmission=e.transmission),e.thickness!==void 0&&(this.thickness=e.thickness),e.attenuationDistance!==void 0&&(this.attenuationDistance=e.attenuationDistance),e.attenuationColor!==void 0&&this.attenuationColor!==void 0&&this.attenuationColor.setHex(e.attenuationColor),e.anisotropy!==void 0&&(this.anisotropy=e.anisotropy),e.anisotropyRotation!==void 0&&(this.anisotropyRotation=e.anisotropyRotation),e.fog!==void 0&&(this.fog=e.fog),e.flatShading!==void 0&&(this.flatShading=e.flatShading),e.blending!==void 0&&(this.blending=e.blending),e.combine!==void 0&&(this.combine=e.combine),e.side!==void 0&&(this.side=e.side),e.shadowSide!==void 0&&(this.shadowSide=e.shadowSide),e.opacity!==void 0&&(this.opacity=e.opacity),e.transparent!==void 0&&(this.transparent=e.transparent),e.alphaTest!==void 0&&(this.alphaTest=e.alphaTest),e.alphaHash!==void 0&&(this.alphaHash=e.alphaHash),e.depthFunc!==void 0&&(this.depthFunc=e.depthFunc),e.depthTest!==void 0&&(this.depthTest=e.depthTest),e.depthWrite!==void 0&&(this.depthWrite=e.depthWrite),e.colorWrite!==void 0&&(this.colorWrite=e.colorWrite),e.clippingPlanes!==void 0&&(this.clippingPlanes=e.clippingPlanes.map(i=>new Ms().fromJSON(i))),e.clipIntersection!==void 0&&(this.clipIntersection=e.clipIntersection),e.clipShadows!==void 0&&(this.clipShadows=e.clipShadows),e.depthPacking!==void 0&&(this.depthPacking=e.depthPacking),e.blendSrc!==void 0&&(this.blendSrc=e.blendSrc),e.blendDst!==void 0&&(this.blendDst=e.blendDst),e.blendEquation!==void 0&&(this.blendEquation=e.blendEquation),e.blendSrcAlpha!==void 0&&(this.blendSrcAlpha=e.blendSrcAlpha),e.blendDstAlpha!==void 0&&(this.blendDstAlpha=e.blendDstAlpha),e.blendEquationAlpha!==void 0&&(this.blendEquationAlpha=e.blendEquationAlpha),e.blendColor!==void 0&&this.blendColor!==void 0&&this.blendColor.setHex(e.blendColor),e.blendAlpha!==void 0&&(this.blendAlpha=e.blendAlpha),e.stencilWriteMask!==void 0&&(this.stencilWriteMask=e.stencilWriteMask),e.stencilFunc!==void 0&&(this.stencilFunc=e.stencilFunc),e.stencilRef!==void 0&&(this.stencilRef=e.stencilRef),e.stencilFuncMask!==void 0&&(this.stencilFuncMask=e.stencilFuncMask),e.stencilFail!==void 0&&(this.stencilFail=e.stencilFail),e.stencilZFail!==void 0&&(this.stencilZFail=e.stencilZFail),e.stencilZPass!==void 0&&(this.stencilZPass=e.stencilZPass),e.stencilWrite!==void 0&&(this.stencilWrite=e.stencilWrite),e.wireframe!==void 0&&(this.wireframe=e.wireframe),e.wireframeLinewidth!==void 0&&(this.wireframeLinewidth=e.wireframeLinewidth),e.wireframeLinecap!==void 0&&(this.wireframeLinecap=e.wireframeLinecap),e.wireframeLinejoin!==void 0&&(this.wireframeLinejoin=e.wireframeLinejoin),e.rotation!==void 0&&(this.rotation=e.rotation),e.linewidth!==void 0&&(this.linewidth=e.linewidth),e.linecap!==void 0&&(this.linecap=e.linecap),e.linejoin!==void 0&&(this.linejoin=e.linejoin),e.dashSize!==void 0&&(this.dashSize=e.dashSize),e.gapSize!==void 0&&(this.gapSize=e.gapSize),e.scale!==void 0&&(this.scale=e.scale),e.polygonOffset!==void 0&&(this.polygonOffset=e.polygonOffset),e.polygonOffsetFactor!==void 0&&(this.polygonOffsetFactor=e.polygonOffsetFactor),e.polygonOffsetUnits!==void 0&&(this.polygonOffsetUnits=e.polygonOffsetUnits),e.dithering!==void 0&&(this.dithering=e.dithering),e.alphaToCoverage!==void 0&&(this.alphaToCoverage=e.alphaToCoverage),e.premultipliedAlpha!==void 0&&(this.premultipliedAlpha=e.premultipliedAlpha),e.forceSinglePass!==void 0&&(this.forceSinglePass=e.forceSinglePass),e.allowOverride!==void 0&&(this.allowOverride=e.allowOverride),e.visible!==void 0&&(this.visible=e.visible),e.toneMapped!==void 0&&(this.toneMapped=e.toneMapped),e.userData!==void 0&&(this.userData=e.userData),e.vertexColors!==void 0&&(typeof e.vertexColors=="number"?this.vertexColors=e.vertexColors>0:this.vertexColors=e.vertexColors),e.size!==void 0&&(this.size=e.size),e.sizeAttenuation!==void 0&&(this.sizeAttenuation=e.sizeAttenuation),e.map!==void 0&&(this.map=t[e.map]||null),e.matcap!==void 0&&(this.matcap=t[e.matcap]||null),e.alphaMap!==void 0&&(this.alphaMap=t[e.alphaMap]||null),e.bumpMap!==void 0&&(this.bumpMap=t[e.bumpMap]||null),e.bumpScale!==void 0&&(this.bumpScale=e.bumpScale),e.normalMap!==void 0&&(this.normalMap=t[e.normalMap]||null),e.normalMapType!==void 0&&(this.normalMapType=e.normalMapType),e.normalScale!==void 0){let i=e.normalScale;Array.isArray(i)===!1&&(i=[i,i]),this.normalScale=new at().fromArray(i)}return e.displacementMap!==void 0&&(this.displacementMap=t[e.displacementMap]||null),e.displacementScale!==void 0&&(this.displacementScale=e.displacementScale),e.displacementBias!==void 0&&(this.displacementBias=e.displacementBias),e.roughnessMap!==void 0&&(this.roughnessMap=t[e.roughnessMap]||null),e.metalnessMap!==void 0&&(this.metalnessMap=t[e.metalnessMap]||null),e.emissiveMap!==void 0&&(this.emissiveMap=t[e.emissiveMap]||null),e.emissiveIntensity!==void 0&&(this.emissiveIntensity=e.emissiveIntensity),e.specularMap!==void 0&&(this.specularMap=t[e.specularMap]||null),e.specularIntensityMap!==void 0&&(this.specularIntensityMap=t[e.specularIntensityMap]||null),e.specularColorMap!==void 0&&(this.specularColorMap=t[e.specularColorMap]||null),e.envMap!==void 0&&(this.envMap=t[e.envMap]||null),e.envMapRotation!==void 0&&this.envMapRotation.fromArray(e.envMapRotation),e.envMapIntensity!==void 0&&(this.envMapIntensity=e.envMapIntensity),e.reflectivity!==void 0&&(this.reflectivity=e.reflectivity),e.refractionRatio!==void 0&&(this.refractionRatio=e.refractionRatio),e.lightMap!==void 0&&(this.lightMap=t[e.lightMap]||null),e.lightMapIntensity!==void 0&&(this.lightMapIntensity=e.lightMapIntensity),e.aoMap!==void 0&&(this.aoMap=t[e.aoMap]||null),e.aoMapIntensity!==void 0&&(this.aoMapIntensity=e.aoMapIntensity),e.gradientMap!==void 0&&(this.gradientMap=t[e.gradientMap]||null),e.clearcoatMap!==void 0&&(this.clearcoatMap=t[e.clearcoatMap]||null),e.clearcoatRoughnessMap!==void 0&&(this.clearcoatRoughnessMap=t[e.clearcoatRoughnessMap]||null),e.clearcoatNormalMap!==void 0&&(this.clearcoatNormalMap=t[e.clearcoatNormalMap]||null),e.clearcoatNormalScale!==void 0&&(this.clearcoatNormalScale=new at().fromArray(e.clearcoatNormalScale)),e.diffuseRoughnessMap!==void 0&&(this.diffuseRoughnessMap=t[e.diffuseRoughnessMap]||null),e.iridescenceMap!==void 0&&(this.iridescenceMap=t[e.iridescenceMap]||null),e.iridescenceThicknessMap!==void 0&&(this.iridescenceThicknessMap=t[e.iridescenceThicknessMap]||null),e.transmissionMap!==void 0&&(this.transmissionMap=t[e.transmissionMap]||null),e.thicknessMap!==void 0&&(this.thicknessMap=t[e.thicknessMap]||null),e.anisotropyMap!==void 0&&(this.anisotropyMap=t[e.anisotropyMap]||null),e.sheenColorMap!==void 0&&(this.sheenColorMap=t[e.sheenColorMap]||null),e.sheenRoughnessMap!==void 0&&(this.sheenRoughnessMap=t[e.sheenRoughnessMap]||null),this}clone(){return new this.constructor().copy(this)}copy(e){this.name=e.name,this.blending=e.blending,this.side=e.side,this.vertexColors=e.vertexColors,this.opacity=e.opacity,this.transparent=e.transparent,this.blendSrc=e.blendSrc,this.blendDst=e.blendDst,this.blendEquation=e.blendEquation,this.blendSrcAlpha=e.blendSrcAlpha,this.blendDstAlpha=e.blendDstAlpha,this.blendEquationAlpha=e.blendEquationAlpha,this.blendColor.copy(e.blendColor),this.blendAlpha=e.blendAlpha,this.depthFunc=e.depthFunc,this.depthTest=e.depthTest,this.depthWrite=e.depthWrite,this.stencilWriteMask=e.stencilWriteMask,this.stencilFunc=e.stencilFunc,this.stencilRef=e.stencilRef,this.stencilFuncMask=e.stencilFuncMask,this.stencilFail=e.stencilFail,this.stencilZFail=e.stencilZFail,this.stencilZPass=e.stencilZPass,this.stencilWrite=e.stencilWrite;let t=e.clippingPlanes,i=null;if(t!==null){let s=t.length;i=new Array(s);for(let r=0;r!==s;++r)i[r]=t[r].clone()}return this.clippingPlanes=i,this.clipIntersection=e.clipIntersection,this.clipShadows=e.clipShadows,this.shadowSide=e.shadowSide,this.colorWrite=e.colorWrite,this.precision=e.precision,this.polygonOffset=e.polygonOffset,this.polygonOffsetFactor=e.polygonOffsetFactor,this.polygonOffsetUnits=e.polygonOffsetUnits,this.dithering=e.dithering,this.alphaTest=e.alphaTest,this.alphaHash=e.alphaHash,this.alphaToCoverage=e.alphaToCoverage,this.premultipliedAlpha=e.premultipliedAlpha,this.forceSinglePass=e.forceSinglePass,this.allowOverride=e.allowOverride,this.visible=e.visible,this.toneMapped=e.toneMapped,this.userData=JSON.parse(JSON.stringify(e.userData)),this}dispose(){this.dispatchEvent({type:"dispose"})}set needsUpdate(e){e===!0&&this.version++}};var gr=new B,Wp=new B,Zu=new B,Ju=new B,yc=class{constructor(e=new B,t=new B(0,0,-1)){this.origin=e,this.direction=t}set(e,t){return this.origin.copy(e),this.direction.copy(t),this}copy(e){return this.origin.copy(e.origin),this.direction.copy(e.direction),this}at(e,t){return t.copy(this.origin).addScaledVector(this.direction,e)}lookAt(e){return this.direction.copy(e).sub(this.origin).normalize(),this}recast(e){return this.origin.copy(this.at(e,gr)),this}closestPointToPoint(e,t){t.subVectors(e,this.origin);let i=t.dot(this.direction);return i<0?t.copy(this.origin):t.copy(this.origin).addScaledVector(this.direction,i)}distanceToPoint(e){return Math.sqrt(this.distanceSqToPoint(e))}distanceSqToPoint(e){let t=gr.subVectors(e,this.origin).dot(this.direction);return t<0?this.origin.distanceToSquared(e):(gr.copy(this.origin).addScaledVector(this.direction,t),gr.distanceToSquared(e))}distanceSqToSegment(e,t,i,s){Wp.copy(e).add(t).multiplyScalar(.5),Zu.copy(t).sub(e).normalize(),Ju.copy(this.origin).sub(Wp);let r=e.distanceTo(t)*.5,o=-this.direction.dot(Zu),a=Ju.dot(this.direction),l=-Ju.dot(Zu),c=Ju.lengthSq(),u=Math.abs(1-o*o),h,d,f,m;if(u>0)if(h=o*l-a,d=o*a-l,m=r*u,h>=0)if(d>=-m)if(d<=m){let y=1/u;h*=y,d*=y,f=h*(h+o*d+2*a)+d*(o*h+d+2*l)+c}else d=r,h=Math.max(0,-(o*d+a)),f=-h*h+d*(d+2*l)+c;else d=-r,h=Math.max(0,-(o*d+a)),f=-h*h+d*(d+2*l)+c;else d<=-m?(h=Math.max(0,-(-o*r+a)),d=h>0?-r:Math.min(Math.max(-r,-l),r),f=-h*h+d*(d+2*l)+c):d<=m?(h=0,d=Math.min(Math.max(-r,-l),r),f=d*(d+2*l)+c):(h=Math.max(0,-(o*r+a)),d=h>0?r:Math.min(Math.max(-r,-l),r),f=-h*h+d*(d+2*l)+c);else d=o>0?-r:r,h=Math.max(0,-(o*d+a)),f=-h*h+d*(d+2*l)+c;return i&&i.copy(this.origin).addScaledVector(this.direction,h),s&&s.copy(Wp).addScaledVector(Zu,d),f}intersectSphere(e,t){if(e.radius<0)return null;gr.subVectors(e.center,this.origin);let i=gr.dot(this.direction),s=gr.dot(gr)-i*i,r=e.radius*e.radius;if(s>r)return null;let o=Math.sqrt(r-s),a=i-o,l=i+o;return l<0?null:a<0?this.at(l,t):this.at(a,t)}intersectsSphere(e){return e.radius<0?!1:this.distanceSqToPoint(e.center)<=e.radius*e.radius}distanceToPlane(e){let t=e.normal.dot(this.direction);if(t===0)return e.distanceToPoint(this.origin)===0?0:null;let i=-(this.origin.dot(e.normal)+e.constant)/t;return i>=0?i:null}intersectPlane(e,t){let i=this.distanceToPlane(e);return i===null?null:this.at(i,t)}intersectsPlane(e){let t=e.distanceToPoint(this.origin);return t===0||e.normal.dot(this.direction)*t<0}intersectBox(e,t){let i,s,r,o,a,l,c=1/this.direction.x,u=1/this.direction.y,h=1/this.direction.z,d=this.origin;return c>=0?(i=(e.min.x-d.x)*c,s=(e.max.x-d.x)*c):(i=(e.max.x-d.x)*c,s=(e.min.x-d.x)*c),u>=0?(r=(e.min.y-d.y)*u,o=(e.max.y-d.y)*u):(r=(e.max.y-d.y)*u,o=(e.min.y-d.y)*u),i>o||r>s||((r>i||isNaN(i))&&(i=r),(o<s||isNaN(s))&&(s=o),h>=0?(a=(e.min.z-d.z)*h,l=(e.max.z-d.z)*h):(a=(e.max.z-d.z)*h,l=(e.min.z-d.z)*h),i>l||a>s)||((a>i||i!==i)&&(i=a),(l<s||s!==s)&&(s=l),s<0)?null:this.at(i>=0?i:s,t)}intersectsBox(e){return this.intersectBox(e,gr)!==null}intersectTriangle(e,t,i,s,r){let o=this.origin,a=this.direction,l=a.x,c=a.y,u=a.z,h=e.x-o.x,d=e.y-o.y,f=e.z-o.z,m=t.x-o.x,y=t.y-o.y,g=t.z-o.z,p=i.x-o.x,x=i.y-o.y,T=i.z-o.z,b=Math.abs(l),R=Math.abs(c),A=Math.abs(u),v,E,k,U,I,z,H,N,G,Y,W,ce;if(b>=R&&b>=A?(k=l,z=h,G=m,ce=p,l>=0?(v=c,E=u,U=d,I=f,H=y,N=g,Y=x,W=T):(v=u,E=c,U=f,I=d,H=g,N=y,Y=T,W=x)):R>=A?(k=c,z=d,G=y,ce=x,c>=0?(v=u,E=l,U=f,I=h,H=g,N=m,Y=T,W=p):(v=l,E=u,U=h,I=f,H=m,N=g,Y=p,W=T)):(k=u,z=f,G=g,ce=T,u>=0?(v=l,E=c,U=h,I=d,H=m,N=y,Y=p,W=x):(v=c,E=l,U=d,I=h,H=y,N=m,Y=x,W=p)),k===0)return null;let J=v/k,Q=E/k,se=1/k,de=U-J*z,he=I-Q*z,ee=H-J*G,ge=N-Q*G,ye=Y-J*ce,Ce=W-Q*ce,Me=ye*ge-Ce*ee,We=de*Ce-he*ye,rt=ee*he-ge*de;if(s){if(Me<0||We<0||rt<0)return null}else if((Me<0||We<0||rt<0)&&(Me>0||We>0||rt>0))return null;let $e=Me+We+rt;if($e===0)return null;let mt=se*(Me*z+We*G+rt*ce);return($e>0?mt<0:mt>0)?null:this.at(mt/$e,r)}applyMatrix4(e){return this.origin.applyMatrix4(e),this.direction.transformDirection(e),this}equals(e){return e.origin.equals(this.origin)&&e.direction.equals(this.direction)}clone(){return new this.constructor().copy(this)}},Fo=class extends xr{constructor(e){super(),this.isMeshBasicMaterial=!0,this.type="MeshBasicMaterial",this.color=new lt(16777215),this.map=null,this.lightMap=null,this.lightMapIntensity=1,this.aoMap=null,this.aoMapIntensity=1,this.specularMap=null,this.alphaMap=null,this.envMap=null,this.envMapRotation=new yr,this.combine=Xh,this.reflectivity=1,this.refractionRatio=.98,this.wireframe=!1,this.wireframeLinewidth=1,this.wireframeLinecap="round",this.wireframeLinejoin="round",this.fog=!0,this.setValues(e)}copy(e){return super.copy(e),this.color.copy(e.color),this.map=e.map,this.lightMap=e.lightMap,this.lightMapIntensity=e.lightMapIntensity,this.aoMap=e.aoMap,this.aoMapIntensity=e.aoMapIntensity,this.specularMap=e.specularMap,this.alphaMap=e.alphaMap,this.envMap=e.envMap,this.envMapRotation.copy(e.envMapRotation),this.combine=e.combine,this.reflectivity=e.reflectivity,this.refractionRatio=e.refractionRatio,this.wireframe=e.wireframe,this.wireframeLinewidth=e.wireframeLinewidth,this.wireframeLinecap=e.wireframeLinecap,this.wireframeLinejoin=e.wireframeLinejoin,this.fog=e.fog,this}},I_=new ht,No=new yc,Ku=new Pn,L_=new B,Qu=new B,eh=new B,th=new B,Xp=new B,nh=new B,D_=new B,ih=new B,Zn=class extends ti{constructor(e=new Bn,t=new Fo){super(),this.isMesh=!0,this.type="Mesh",this.geometry=e,this.material=t,this.morphTargetDictionary=void 0,this.morphTargetInfluences=void 0,this.count=1,this.updateMorphTargets()}copy(e,t){return super.copy(e,t),e.morphTargetInfluences!==void 0?this.morphTargetInfluences=e.morphTargetInfluences.slice():this.morphTargetInfluences=void 0,e.morphTargetDictionary!==void 0?this.morphTargetDictionary=Object.assign({},e.morphTargetDictionary):this.morphTargetDictionary=void 0,this.material=Array.isArray(e.material)?e.material.slice():e.material,this.geometry=e.geometry,this}updateMorphTargets(){let t=this.geometry.morphAttributes,i=Object.keys(t);if(i.length>0){let s=t[i[0]];if(s!==void 0){this.morphTargetInfluences=[],this.morphTargetDictionary={};for(let r=0,o=s.length;r<o;r++){let a=s[r].name||String(r);this.morphTargetInfluences.push(0),this.morphTargetDictionary[a]=r}}}}getVertexPosition(e,t){let i=this.geometry,s=i.attributes.position,r=i.morphAttributes.position,o=i.morphTargetsRelative;t.fromBufferAttribute(s,e);let a=this.morphTargetInfluences;if(r&&a){nh.set(0,0,0);for(let l=0,c=r.length;l<c;l++){let u=a[l],h=r[l];u!==0&&(Xp.fromBufferAttribute(h,e),o?nh.addScaledVector(Xp,u):nh.addScaledVector(Xp.sub(t),u))}t.add(nh)}return t}intersectsFrustum(e){return e.intersectsObject(this)}raycast(e,t){let i=this.geometry,s=this.material,r=this.matrixWorld;s!==void 0&&(i.boundingSphere===null&&i.computeBoundingSphere(),Ku.copy(i.boundingSphere),Ku.applyMatrix4(r),No.copy(e.ray).recast(e.near),!(Ku.containsPoint(No.origin)===!1&&(No.intersectSphere(Ku,L_)===null||No.origin.distanceToSquared(L_)>(e.far-e.near)**2))&&(I_.copy(r).invert(),No.copy(e.ray).applyMatrix4(I_),!(i.boundingBox!==null&&No.intersectsBox(i.boundingBox)===!1)&&this._computeIntersections(e,t,No)))}_computeIntersections(e,t,i){let s,r=this.geometry,o=this.material,a=r.index,l=r.attributes.position,c=r.attributes.uv,u=r.attributes.uv1,h=r.attributes.normal,d=r.groups,f=r.drawRange;if(a!==null)if(Array.isArray(o))for(let m=0,y=d.length;m<y;m++){let g=d[m],p=o[g.materialIndex],x=Math.max(g.start,f.start),T=Math.min(a.count,Math.min(g.start+g.count,f.start+f.count));for(let b=x,R=T;b<R;b+=3){let A=a.getX(b),v=a.getX(b+1),E=a.getX(b+2);s=sh(this,p,e,i,c,u,h,A,v,E),s&&(s.faceIndex=Math.floor(b/3),s.face.materialIndex=g.materialIndex,t.push(s))}}else{let m=Math.max(0,f.start),y=Math.min(a.count,f.start+f.count);for(let g=m,p=y;g<p;g+=3){let x=a.getX(g),T=a.getX(g+1),b=a.getX(g+2);s=sh(this,o,e,i,c,u,h,x,T,b),s&&(s.faceIndex=Math.floor(g/3),t.push(s))}}else if(l!==void 0)if(Array.isArray(o))for(let m=0,y=d.length;m<y;m++){let g=d[m],p=o[g.materialIndex],x=Math.max(g.start,f.start),T=Math.min(l.count,Math.min(g.start+g.count,f.start+f.count));for(let b=x,R=T;b<R;b+=3){let A=b,v=b+1,E=b+2;s=sh(this,p,e,i,c,u,h,A,v,E),s&&(s.faceIndex=Math.floor(b/3),s.face.materialIndex=g.materialIndex,t.push(s))}}else{let m=Math.max(0,f.start),y=Math.min(l.count,f.start+f.count);for(let g=m,p=y;g<p;g+=3){let x=g,T=g+1,b=g+2;s=sh(this,o,e,i,c,u,h,x,T,b),s&&(s.faceIndex=Math.floor(g/3),t.push(s))}}}};function Sw(n,e,t,i,s,r,o,a){let l;if(e.side===Ci?l=i.intersectTriangle(o,r,s,!0,a):l=i.intersectTriangle(s,r,o,e.side===to,a),l===null)return null;ih.copy(a),ih.applyMatrix4(n.matrixWorld);let c=t.ray.origin.distanceTo(ih);return c<t.near||c>t.far?null:{distance:c,point:ih.clone(),object:n}}function sh(n,e,t,i,s,r,o,a,l,c){n.getVertexPosition(a,Qu),n.getVertexPosition(l,eh),n.getVertexPosition(c,th);let u=Sw(n,e,t,i,Qu,eh,th,D_);if(u){let h=new B;Zr.getBarycoord(D_,Qu,eh,th,h),s&&(u.uv=Zr.getInterpolatedAttribute(s,a,l,c,h,new at)),r&&(u.uv1=Zr.getInterpolatedAttribute(r,a,l,c,h,new at)),o&&(u.normal=Zr.getInterpolatedAttribute(o,a,l,c,h,new B),u.normal.dot(i.direction)>0&&u.normal.multiplyScalar(-1));let d={a,b:l,c,normal:new B,materialIndex:0};Zr.getNormal(Qu,eh,th,d.normal),u.face=d,u.barycoord=h}return u}var Bo=class extends Ui{constructor(e=null,t=1,i=1,s,r,o,a,l,c=Rn,u=Rn,h,d){super(null,o,a,l,c,u,s,r,h,d),this.isDataTexture=!0,this.image={data:e,width:t,height:i},this.generateMipmaps=!1,this.flipY=!1,this.unpackAlignment=1}};var xc=class extends fn{constructor(e,t,i,s=1){super(e,t,i),this.isInstancedBufferAttribute=!0,this.meshPerAttribute=s}copy(e){return super.copy(e),this.meshPerAttribute=e.meshPerAttribute,this}toJSON(){let e=super.toJSON();return e.meshPerAttribute=this.meshPerAttribute,e.isInstancedBufferAttribute=!0,e}},ka=new ht,N_=new ht,rh=[],U_=new Fn,Mw=new ht,oc=new Zn,ac=new Pn,Qa=class extends Zn{constructor(e,t,i){super(e,t),this.isInstancedMesh=!0,this.instanceMatrix=new xc(new Float32Array(i*16),16),this.instanceColor=null,this.morphTexture=null,this.count=i,this.boundingBox=null,this.boundingSphere=null;for(let s=0;s<i;s++)this.setMatrixAt(s,Mw)}computeBoundingBox(){let e=this.geometry,t=this.count;this.boundingBox===null&&(this.boundingBox=new Fn),e.boundingBox===null&&e.computeBoundingBox(),this.boundingBox.makeEmpty();for(let i=0;i<t;i++)this.getMatrixAt(i,ka),U_.copy(e.boundingBox).applyMatrix4(ka),this.boundingBox.union(U_)}computeBoundingSphere(){let e=this.geometry,t=this.count;this.boundingSphere===null&&(this.boundingSphere=new Pn),e.boundingSphere===null&&e.computeBoundingSphere(),this.boundingSphere.makeEmpty();for(let i=0;i<t;i++)this.getMatrixAt(i,ka),ac.copy(e.boundingSphere).applyMatrix4(ka),this.boundingSphere.union(ac)}copy(e,t){return super.copy(e,t),this.instanceMatrix.copy(e.instanceMatrix),this.morphTexture=e.morphTexture!==null?e.morphTexture.clone():null,this.instanceColor=e.instanceColor!==null?e.instanceColor.clone():null,this.count=e.count,this.boundingBox=e.boundingBox!==null?e.boundingBox.clone():null,this.boundingSphere=e.boundingSphere!==null?e.boundingSphere.clone():null,this}getColorAt(e,t){return this.instanceColor===null?t.setRGB(1,1,1):t.fromArray(this.instanceColor.array,e*3)}getMatrixAt(e,t){return t.fromArray(this.instanceMatrix.array,e*16)}getMorphAt(e,t){let i=t.morphTargetInfluences,s=this.morphTexture.source.data.data,r=i.length+1,o=e*r+1;for(let a=0;a<i.length;a++)i[a]=s[o+a]}raycast(e,t){let i=this.matrixWorld,s=this.count;if(oc.geometry=this.geometry,oc.material=this.material,oc.material!==void 0&&(this.boundingSphere===null&&this.computeBoundingSphere(),ac.copy(this.boundingSphere),ac.applyMatrix4(i),e.ray.intersectsSphere(ac)!==!1))for(let r=0;r<s;r++){this.getMatrixAt(r,ka),N_.multiplyMatrices(i,ka),oc.matrixWorld=N_,oc.raycast(e,rh);for(let o=0,a=rh.length;o<a;o++){let l=rh[o];l.instanceId=r,l.object=this,t.push(l)}rh.length=0}}setColorAt(e,t){return this.instanceColor===null&&(this.instanceColor=new xc(new Float32Array(this.instanceMatrix.count*3).fill(1),3)),t.toArray(this.instanceColor.array,e*3),this}setMatrixAt(e,t){return t.toArray(this.instanceMatrix.array,e*16),this}setMorphAt(e,t){let i=t.morphTargetInfluences,s=i.length+1;this.morphTexture===null&&(this.morphTexture=new Bo(new Float32Array(s*this.count),s,this.count,Qh,Oi));let r=this.morphTexture.source.data.data,o=0;for(let c=0;c<i.length;c++)o+=i[c];let a=this.geometry.morphTargetsRelative?1:1-o,l=s*e;return r[l]=a,r.set(i,l+1),this}updateMorphTargets(){}dispose(){super.dispose(),this.instanceMatrix.dispose(),this.instanceColor!==null&&this.instanceColor.dispose(),this.morphTexture!==null&&(this.morphTexture.dispose(),this.morphTexture=null)}},Uo=new Pn,ww=new at(.5,.5),oh=new B,Gs=class{constructor(e=new Ms,t=new Ms,i=new Ms,s=new Ms,r=new Ms,o=new Ms){this.planes=[e,t,i,s,r,o]}set(e,t,i,s,r,o){let a=this.planes;return a[0].copy(e),a[1].copy(t),a[2].copy(i),a[3].copy(s),a[4].copy(r),a[5].copy(o),this}copy(e){let t=this.planes;for(let i=0;i<6;i++)t[i].copy(e.planes[i]);return this}setFromProjectionMatrix(e,t=is,i=!1){let s=this.planes,r=e.elements,o=r[0],a=r[1],l=r[2],c=r[3],u=r[4],h=r[5],d=r[6],f=r[7],m=r[8],y=r[9],g=r[10],p=r[11],x=r[12],T=r[13],b=r[14],R=r[15];if(s[0].setComponents(c-o,f-u,p-m,R-x).normalize(),s[1].setComponents(c+o,f+u,p+m,R+x).normalize(),s[2].setComponents(c+a,f+h,p+y,R+T).normalize(),s[3].setComponents(c-a,f-h,p-y,R-T).normalize(),i)s[4].setComponents(l,d,g,b).normalize(),s[5].setComponents(c-l,f-d,p-g,R-b).normalize();else if(s[4].setComponents(c-l,f-d,p-g,R-b).normalize(),t===is)s[5].setComponents(c+l,f+d,p+g,R+b).normalize();else if(t===Ya)s[5].setComponents(l,d,g,b).normalize();else throw new Error("THREE.Frustum.setFromProjectionMatrix(): Invalid coordinate system: "+t);return this}intersectsObject(e){if(e.boundingSphere!==void 0)e.boundingSphere===null&&e.computeBoundingSphere(),Uo.copy(e.boundingSphere).applyMatrix4(e.matrixWorld);else{let t=e.geometry;t.boundingSphere===null&&t.computeBoundingSphere(),Uo.copy(t.boundingSphere).applyMatrix4(e.matrixWorld)}return this.intersectsSphere(Uo)}intersectsSprite(e){Uo.center.set(0,0,0);let t=ww.distanceTo(e.center);return Uo.radius=.7071067811865476+t,Uo.applyMatrix4(e.matrixWorld),this.intersectsSphere(Uo)}intersectsSphere(e){let t=this.planes,i=e.center,s=-e.radius;for(let r=0;r<6;r++)if(t[r].distanceToPoint(i)<s)return!1;return!0}intersectsBox(e){let t=this.planes;for(let i=0;i<6;i++){let s=t[i];if(oh.x=s.normal.x>0?e.max.x:e.min.x,oh.y=s.normal.y>0?e.max.y:e.min.y,oh.z=s.normal.z>0?e.max.z:e.min.z,s.distanceToPoint(oh)<0)return!1}return!0}containsPoint(e){let t=this.planes;for(let i=0;i<6;i++)if(t[i].distanceToPoint(e)<0)return!1;return!0}clone(){return new this.constructor().copy(this)}},O_=new ht,Ch=class n{constructor(){this.coordinateSystem=is,this._frustums=[],this._count=0}setFromArrayCamera(e){let t=e.cameras,i=this._frustums;for(let s=0;s<t.length;s++){let r=t[s];O_.multiplyMatrices(r.projectionMatrix,r.matrixWorldInverse),i[s]===void 0&&(i[s]=new Gs),i[s].setFromProjectionMatrix(O_,r.coordinateSystem,r.reversedDepth)}return this._count=t.length,this}getFrustum(e){return this._frustums[e]}intersectsObject(e){let t=this._frustums;for(let i=0;i<this._count;i++)if(t[i].intersectsObject(e))return!0;return!1}intersectsSprite(e){let t=this._frustums;for(let i=0;i<this._count;i++)if(t[i].intersectsSprite(e))return!0;return!1}intersectsSphere(e){let t=this._frustums;for(let i=0;i<this._count;i++)if(t[i].intersectsSphere(e))return!0;return!1}intersectsBox(e){let t=this._frustums;for(let i=0;i<this._count;i++)if(t[i].intersectsBox(e))return!0;return!1}containsPoint(e){let t=this._frustums;for(let i=0;i<this._count;i++)if(t[i].containsPoint(e))return!0;return!1}copy(e){this.coordinateSystem=e.coordinateSystem;let t=this._frustums,i=e._frustums;for(let s=0;s<e._count;s++)t[s]===void 0&&(t[s]=new Gs),t[s].copy(i[s]);return this._count=e._count,this}clone(){return new n().copy(this)}};var Rh=class extends xr{constructor(e){super(),this.isPointsMaterial=!0,this.type="PointsMaterial",this.color=new lt(16777215),this.map=null,this.alphaMap=null,this.size=1,this.sizeAttenuation=!0,this.fog=!0,this.setValues(e)}copy(e){return super.copy(e),this.color.copy(e.color),this.map=e.map,this.alphaMap=e.alphaMap,this.size=e.size,this.sizeAttenuation=e.sizeAttenuation,this.fog=e.fog,this}},F_=new ht,Qp=new yc,ah=new Pn,lh=new B,bc=class extends ti{constructor(e=new Bn,t=new Rh){super(),this.isPoints=!0,this.type="Points",this.geometry=e,this.material=t,this.morphTargetDictionary=void 0,this.morphTargetInfluences=void 0,this.updateMorphTargets()}copy(e,t){return super.copy(e,t),e.morphTargetInfluences!==void 0?this.morphTargetInfluences=e.morphTargetInfluences.slice():this.morphTargetInfluences=void 0,e.morphTargetDictionary!==void 0?this.morphTargetDictionary=Object.assign({},e.morphTargetDictionary):this.morphTargetDictionary=void 0,this.material=Array.isArray(e.material)?e.material.slice():e.material,this.geometry=e.geometry,this}intersectsFrustum(e){return e.intersectsObject(this)}raycast(e,t){let i=this.geometry,s=this.matrixWorld,r=e.params.Points.threshold,o=i.drawRange;if(i.boundingSphere===null&&i.computeBoundingSphere(),ah.copy(i.boundingSphere),ah.applyMatrix4(s),ah.radius+=r,e.ray.intersectsSphere(ah)===!1)return;F_.copy(s).invert(),Qp.copy(e.ray).applyMatrix4(F_);let a=r/((this.scale.x+this.scale.y+this.scale.z)/3),l=a*a,c=i.index,h=i.attributes.position;if(c!==null){let d=Math.max(0,o.start),f=Math.min(c.count,o.start+o.count);for(let m=d,y=f;m<y;m++){let g=c.getX(m);lh.fromBufferAttribute(h,g),B_(lh,g,l,s,e,t,this)}}else{let d=Math.max(0,o.start),f=Math.min(h.count,o.start+o.count);for(let m=d,y=f;m<y;m++)lh.fromBufferAttribute(h,m),B_(lh,m,l,s,e,t,this)}}updateMorphTargets(){let t=this.geometry.morphAttributes,i=Object.keys(t);if(i.length>0){let s=t[i[0]];if(s!==void 0){this.morphTargetInfluences=[],this.morphTargetDictionary={};for(let r=0,o=s.length;r<o;r++){let a=s[r].name||String(r);this.morphTargetInfluences.push(0),this.morphTargetDictionary[a]=r}}}}};function B_(n,e,t,i,s,r,o){let a=Qp.distanceSqToPoint(n);if(a<t){let l=new B;Qp.closestPointToPoint(n,l),l.applyMatrix4(i);let c=s.ray.origin.distanceTo(l);if(c<s.near||c>s.far)return;r.push({distance:c,distanceToRay:Math.sqrt(a),point:l,index:e,face:null,faceIndex:null,barycoord:null,object:o})}}var Sc=class extends Ui{constructor(e=[],t=$o,i,s,r,o,a,l,c,u){super(e,t,i,s,r,o,a,l,c,u),this.isCubeTexture=!0,this.flipY=!1}get images(){return this.image}set images(e){this.image=e}};var Es=class extends Ui{constructor(e,t,i=Ts,s,r,o,a=Rn,l=Rn,c,u=vr,h=1){if(u!==vr&&u!==Sr)throw new Error("THREE.DepthTexture: format must be either THREE.DepthFormat or THREE.DepthStencilFormat");let d={width:e,height:t,depth:h};super(d,s,r,o,a,l,u,i,c),this.isDepthTexture=!0,this.flipY=!1,this.generateMipmaps=!1,this.compareFunction=null}copy(e){return super.copy(e),this.source=new Ja(Object.assign({},e.image)),this.compareFunction=e.compareFunction,this}toJSON(e){let t=super.toJSON(e);return t.compareFunction=this.compareFunction,t}},Mc=class extends Es{constructor(e,t=Ts,i=$o,s,r,o=Rn,a=Rn,l,c=vr){let u={width:e,height:e,depth:1},h=[u,u,u,u,u,u];super(e,e,t,i,s,r,o,a,l,c),this.image=h,this.isCubeDepthTexture=!0,this.isCubeTexture=!0}get images(){return this.image}set images(e){this.image=e}},wc=class extends Ui{constructor(e=null){super(),this.sourceTexture=e,this.isExternalTexture=!0}copy(e){return super.copy(e),this.sourceTexture=e.sourceTexture,this}},el=class n extends Bn{constructor(e=1,t=1,i=1,s=1,r=1,o=1){super(),this.type="BoxGeometry",this.parameters={width:e,height:t,depth:i,widthSegments:s,heightSegments:r,depthSegments:o};let a=this;s=Math.floor(s),r=Math.floor(r),o=Math.floor(o);let l=[],c=[],u=[],h=[],d=0,f=0;m("z","y","x",-1,-1,i,t,e,o,r,0),m("z","y","x",1,-1,i,t,-e,o,r,1),m("x","z","y",1,1,e,i,t,s,o,2),m("x","z","y",1,-1,e,i,-t,s,o,3),m("x","y","z",1,-1,e,t,i,s,r,4),m("x","y","z",-1,-1,e,t,-i,s,r,5),this.setIndex(l),this.setAttribute("position",new pn(c,3)),this.setAttribute("normal",new pn(u,3)),this.setAttribute("uv",new pn(h,2));function m(y,g,p,x,T,b,R,A,v,E,k){let U=b/v,I=R/E,z=b/2,H=R/2,N=A/2,G=v+1,Y=E+1,W=0,ce=0,J=new B;for(let Q=0;Q<Y;Q++){let se=Q*I-H;for(let de=0;de<G;de++){let he=de*U-z;J[y]=he*x,J[g]=se*T,J[p]=N,c.push(J.x,J.y,J.z),J[y]=0,J[g]=0,J[p]=A>0?1:-1,u.push(J.x,J.y,J.z),h.push(de/v),h.push(1-Q/E),W+=1}}for(let Q=0;Q<E;Q++)for(let se=0;se<v;se++){let de=d+se+G*Q,he=d+se+G*(Q+1),ee=d+(se+1)+G*(Q+1),ge=d+(se+1)+G*Q;l.push(de,he,ge),l.push(he,ee,ge),ce+=6}a.addGroup(f,ce,k),f+=ce,d+=W}}copy(e){return super.copy(e),this.parameters=Object.assign({},e.parameters),this}static fromJSON(e){return new n(e.width,e.height,e.depth,e.widthSegments,e.heightSegments,e.depthSegments)}};var Ph=class n extends Bn{constructor(e=1,t=1,i=1,s=32,r=1,o=!1,a=0,l=Math.PI*2){super(),this.type="CylinderGeometry",this.parameters={radiusTop:e,radiusBottom:t,height:i,radialSegments:s,heightSegments:r,openEnded:o,thetaStart:a,thetaLength:l};let c=this;s=Math.floor(s),r=Math.floor(r);let u=[],h=[],d=[],f=[],m=0,y=[],g=i/2,p=0;x(),o===!1&&(e>0&&T(!0),t>0&&T(!1)),this.setIndex(u),this.setAttribute("position",new pn(h,3)),this.setAttribute("normal",new pn(d,3)),this.setAttribute("uv",new pn(f,2));function x(){let b=new B,R=new B,A=0,v=(t-e)/i;for(let E=0;E<=r;E++){let k=[],U=E/r,I=U*(t-e)+e;for(let z=0;z<=s;z++){let H=z/s,N=H*l+a,G=Math.sin(N),Y=Math.cos(N);R.x=I*G,R.y=-U*i+g,R.z=I*Y,h.push(R.x,R.y,R.z),b.set(G,v,Y).normalize(),d.push(b.x,b.y,b.z),f.push(H,1-U),k.push(m++)}y.push(k)}for(let E=0;E<s;E++)for(let k=0;k<r;k++){let U=y[k][E],I=y[k+1][E],z=y[k+1][E+1],H=y[k][E+1];(e>0||k!==0)&&(u.push(U,I,H),A+=3),(t>0||k!==r-1)&&(u.push(I,z,H),A+=3)}c.addGroup(p,A,0),p+=A}function T(b){let R=m,A=new at,v=new B,E=0,k=b===!0?e:t,U=b===!0?1:-1;for(let z=1;z<=s;z++)h.push(0,g*U,0),d.push(0,U,0),f.push(.5,.5),m++;let I=m;for(let z=0;z<=s;z++){let N=z/s*l+a,G=Math.cos(N),Y=Math.sin(N);v.x=k*Y,v.y=g*U,v.z=k*G,h.push(v.x,v.y,v.z),d.push(0,U,0),A.x=G*.5+.5,A.y=Y*.5*U+.5,f.push(A.x,A.y),m++}for(let z=0;z<s;z++){let H=R+z,N=I+z;b===!0?u.push(N,N+1,H):u.push(N+1,N,H),E+=3}c.addGroup(p,E,b===!0?1:2),p+=E}}copy(e){return super.copy(e),this.parameters=Object.assign({},e.parameters),this}static fromJSON(e){return new n(e.radiusTop,e.radiusBottom,e.height,e.radialSegments,e.heightSegments,e.openEnded,e.thetaStart,e.thetaLength)}},Ec=class n extends Ph{constructor(e=1,t=1,i=32,s=1,r=!1,o=0,a=Math.PI*2){super(0,e,t,i,s,r,o,a),this.type="ConeGeometry",this.parameters={radius:e,height:t,radialSegments:i,heightSegments:s,openEnded:r,thetaStart:o,thetaLength:a}}static fromJSON(e){return new n(e.radius,e.height,e.radialSegments,e.heightSegments,e.openEnded,e.thetaStart,e.thetaLength)}};var Tc=class n extends Bn{constructor(e=1,t=1,i=1,s=1){super(),this.type="PlaneGeometry",this.parameters={width:e,height:t,widthSegments:i,heightSegments:s};let r=e/2,o=t/2,a=Math.floor(i),l=Math.floor(s),c=a+1,u=l+1,h=e/a,d=t/l,f=[],m=[],y=[],g=[];for(let p=0;p<u;p++){let x=p*d-o;for(let T=0;T<c;T++){let b=T*h-r;m.push(b,-x,0),y.push(0,0,1),g.push(T/a),g.push(1-p/l)}}for(let p=0;p<l;p++)for(let x=0;x<a;x++){let T=x+c*p,b=x+c*(p+1),R=x+1+c*(p+1),A=x+1+c*p;f.push(T,b,A),f.push(b,R,A)}this.setIndex(f),this.setAttribute("position",new pn(m,3)),this.setAttribute("normal",new pn(y,3)),this.setAttribute("uv",new pn(g,2))}copy(e){return super.copy(e),this.parameters=Object.assign({},e.parameters),this}static fromJSON(e){return new n(e.width,e.height,e.widthSegments,e.heightSegments)}};var Ac=class n extends Bn{constructor(e=1,t=32,i=16,s=0,r=Math.PI*2,o=0,a=Math.PI){super(),this.type="SphereGeometry",this.parameters={radius:e,widthSegments:t,heightSegments:i,phiStart:s,phiLength:r,thetaStart:o,thetaLength:a},t=Math.max(3,Math.floor(t)),i=Math.max(2,Math.floor(i));let l=Math.min(o+a,Math.PI),c=0,u=[],h=new B,d=new B,f=[],m=[],y=[],g=[];for(let p=0;p<=i;p++){let x=[],T=p/i,b=o+T*a,R=e*Math.cos(b),A=Math.sqrt(e*e-R*R),v=0;p===0&&o===0?v=.5/t:p===i&&l===Math.PI&&(v=-.5/t);for(let E=0;E<=t;E++){let k=E/t,U=s+k*r;h.x=-A*Math.cos(U),h.y=R,h.z=A*Math.sin(U),m.push(h.x,h.y,h.z),d.copy(h).normalize(),y.push(d.x,d.y,d.z),g.push(k+v,1-T),x.push(c++)}u.push(x)}for(let p=0;p<i;p++)for(let x=0;x<t;x++){let T=u[p][x+1],b=u[p][x],R=u[p+1][x],A=u[p+1][x+1];(p!==0||o>0)&&f.push(T,b,A),(p!==i-1||l<Math.PI)&&f.push(b,R,A)}this.setIndex(f),this.setAttribute("position",new pn(m,3)),this.setAttribute("normal",new pn(y,3)),this.setAttribute("uv",new pn(g,2))}copy(e){return super.copy(e),this.parameters=Object.assign({},e.parameters),this}static fromJSON(e){return new n(e.radius,e.widthSegments,e.heightSegments,e.phiStart,e.phiLength,e.thetaStart,e.thetaLength)}};var Cc=class extends Bn{constructor(e=null){if(super(),this.type="WireframeGeometry",this.parameters={geometry:e},e!==null){let t=[],i=new Set,s=new B,r=new B;if(e.index!==null){let o=e.attributes.position,a=e.index,l=e.groups;l.length===0&&(l=[{start:0,count:a.count,materialIndex:0}]);for(let c=0,u=l.length;c<u;++c){let h=l[c],d=h.start,f=h.count;for(let m=d,y=d+f;m<y;m+=3)for(let g=0;g<3;g++){let p=a.getX(m+g),x=a.getX(m+(g+1)%3);s.fromBufferAttribute(o,p),r.fromBufferAttribute(o,x),k_(s,r,i)===!0&&(t.push(s.x,s.y,s.z),t.push(r.x,r.y,r.z))}}}else{let o=e.attributes.position;for(let a=0,l=o.count/3;a<l;a++)for(let c=0;c<3;c++){let u=3*a+c,h=3*a+(c+1)%3;s.fromBufferAttribute(o,u),r.fromBufferAttribute(o,h),k_(s,r,i)===!0&&(t.push(s.x,s.y,s.z),t.push(r.x,r.y,r.z))}}this.setAttribute("position",new pn(t,3))}}copy(e){return super.copy(e),this.parameters=Object.assign({},e.parameters),this}};function k_(n,e,t){let i=`${n.x},${n.y},${n.z}-${e.x},${e.y},${e.z}`,s=`${e.x},${e.y},${e.z}-${n.x},${n.y},${n.z}`;return t.has(i)===!0||t.has(s)===!0?!1:(t.add(i),t.add(s),!0)}function Xo(n){let e={};for(let t in n){e[t]={};for(let i in n[t]){let s=n[t][i];if(z_(s))s.isRenderTargetTexture?(Ze("UniformsUtils: Textures of render targets cannot be cloned via cloneUniforms() or mergeUniforms()."),e[t][i]=null):e[t][i]=s.clone();else if(Array.isArray(s))if(z_(s[0])){let r=[];for(let o=0,a=s.length;o<a;o++)r[o]=s[o].clone();e[t][i]=r}else e[t][i]=s.slice();else e[t][i]=s}}return e}function fi(n){let e={};for(let t=0;t<n.length;t++){let i=Xo(n[t]);for(let s in i)e[s]=i[s]}return e}function z_(n){return n&&(n.isColor||n.isMatrix3||n.isMatrix4||n.isVector2||n.isVector3||n.isVector4||n.isTexture||n.isQuaternion)}function Ew(n){let e=[];for(let t=0;t<n.length;t++)e.push(n[t].clone());return e}function Lm(n){let e=n.getRenderTarget();return e===null?n.outputColorSpace:e.isXRRenderTarget===!0?e.texture.colorSpace:vt.workingColorSpace}var Gc={clone:Xo,merge:fi},Tw=`void main() {
	gl_Position = projectionMatrix * modelViewMatrix * vec4( position, 1.0 );
}`,Aw=`void main() {
	gl_FragColor = vec4( 1.0, 0.0, 0.0, 1.0 );
}`,hi=class extends xr{constructor(e){super(),this.isShaderMaterial=!0,this.type="ShaderMaterial",this.defines={},this.uniforms={},this.uniformsGroups=[],this.vertexShader=Tw,this.fragmentShader=Aw,this.linewidth=1,this.wireframe=!1,this.wireframeLinewidth=1,this.fog=!1,this.lights=!1,this.clipping=!1,this.forceSinglePass=!0,this.extensions={clipCullDistance:!1,multiDraw:!1},this.defaultAttributeValues={color:[1,1,1],uv:[0,0],uv1:[0,0]},this.index0AttributeName=void 0,this.uniformsNeedUpdate=!1,this.glslVersion=null,e!==void 0&&this.setValues(e)}copy(e){return super.copy(e),this.fragmentShader=e.fragmentShader,this.vertexShader=e.vertexShader,this.uniforms=Xo(e.uniforms),this.uniformsGroups=Ew(e.uniformsGroups),this.defines=Object.assign({},e.defines),this.wireframe=e.wireframe,this.wireframeLinewidth=e.wireframeLinewidth,this.fog=e.fog,this.lights=e.lights,this.clipping=e.clipping,this.extensions=Object.assign({},e.extensions),this.glslVersion=e.glslVersion,this.defaultAttributeValues=Object.assign({},e.defaultAttributeValues),this.index0AttributeName=e.index0AttributeName,this.uniformsNeedUpdate=e.uniformsNeedUpdate,this}toJSON(e){let t=super.toJSON(e);t.glslVersion=this.glslVersion,t.uniforms={};for(let s in this.uniforms){let o=this.uniforms[s].value;o&&o.isTexture?t.uniforms[s]={type:"t",value:o.toJSON(e).uuid}:o&&o.isColor?t.uniforms[s]={type:"c",value:o.getHex()}:o&&o.isVector2?t.uniforms[s]={type:"v2",value:o.toArray()}:o&&o.isVector3?t.uniforms[s]={type:"v3",value:o.toArray()}:o&&o.isVector4?t.uniforms[s]={type:"v4",value:o.toArray()}:o&&o.isMatrix3?t.uniforms[s]={type:"m3",value:o.toArray()}:o&&o.isMatrix4?t.uniforms[s]={type:"m4",value:o.toArray()}:t.uniforms[s]={value:o}}Object.keys(this.defines).length>0&&(t.defines=this.defines),t.vertexShader=this.vertexShader,t.fragmentShader=this.fragmentShader,t.lights=this.lights,t.clipping=this.clipping;let i={};for(let s in this.extensions)this.extensions[s]===!0&&(i[s]=!0);return Object.keys(i).length>0&&(t.extensions=i),t}fromJSON(e,t){if(super.fromJSON(e,t),e.uniforms!==void 0)for(let i in e.uniforms){let s=e.uniforms[i];switch(this.uniforms[i]={},s.type){case"t":this.uniforms[i].value=t[s.value]||null;break;case"c":this.uniforms[i].value=new lt().setHex(s.value);break;case"v2":this.uniforms[i].value=new at().fromArray(s.value);break;case"v3":this.uniforms[i].value=new B().fromArray(s.value);break;case"v4":this.uniforms[i].value=new It().fromArray(s.value);break;case"m3":this.uniforms[i].value=new nt().fromArray(s.value);break;case"m4":this.uniforms[i].value=new ht().fromArray(s.value);break;default:this.uniforms[i].value=s.value}}if(e.defines!==void 0&&(this.defines=e.defines),e.vertexShader!==void 0&&(this.vertexShader=e.vertexShader),e.fragmentShader!==void 0&&(this.fragmentShader=e.fragmentShader),e.glslVersion!==void 0&&(this.glslVersion=e.glslVersion),e.extensions!==void 0)for(let i in e.extensions)this.extensions[i]=e.extensions[i];return e.lights!==void 0&&(this.lights=e.lights),e.clipping!==void 0&&(this.clipping=e.clipping),this}},Ih=class extends hi{constructor(e){super(e),this.isRawShaderMaterial=!0,this.type="RawShaderMaterial"}};var Rc=class extends xr{constructor(e){super(),this.isMeshLambertMaterial=!0,this.type="MeshLambertMaterial",this.color=new lt(16777215),this.map=null,this.lightMap=null,this.lightMapIntensity=1,this.aoMap=null,this.aoMapIntensity=1,this.emissive=new lt(0),this.emissiveIntensity=1,this.emissiveMap=null,this.bumpMap=null,this.bumpScale=1,this.normalMap=null,this.normalMapType=Dd,this.normalScale=new at(1,1),this.displacementMap=null,this.displacementScale=1,this.displacementBias=0,this.specularMap=null,this.alphaMap=null,this.envMap=null,this.envMapRotation=new yr,this.combine=Xh,this.reflectivity=1,this.envMapIntensity=1,this.refractionRatio=.98,this.wireframe=!1,this.wireframeLinewidth=1,this.wireframeLinecap="round",this.wireframeLinejoin="round",this.flatShading=!1,this.fog=!0,this.setValues(e)}copy(e){return super.copy(e),this.color.copy(e.color),this.map=e.map,this.lightMap=e.lightMap,this.lightMapIntensity=e.lightMapIntensity,this.aoMap=e.aoMap,this.aoMapIntensity=e.aoMapIntensity,this.emissive.copy(e.emissive),this.emissiveMap=e.emissiveMap,this.emissiveIntensity=e.emissiveIntensity,this.bumpMap=e.bumpMap,this.bumpScale=e.bumpScale,this.normalMap=e.normalMap,this.normalMapType=e.normalMapType,this.normalScale.copy(e.normalScale),this.displacementMap=e.displacementMap,this.displacementScale=e.displacementScale,this.displacementBias=e.displacementBias,this.specularMap=e.specularMap,this.alphaMap=e.alphaMap,this.envMap=e.envMap,this.envMapRotation.copy(e.envMapRotation),this.combine=e.combine,this.reflectivity=e.reflectivity,this.envMapIntensity=e.envMapIntensity,this.refractionRatio=e.refractionRatio,this.wireframe=e.wireframe,this.wireframeLinewidth=e.wireframeLinewidth,this.wireframeLinecap=e.wireframeLinecap,this.wireframeLinejoin=e.wireframeLinejoin,this.flatShading=e.flatShading,this.fog=e.fog,this}},Lh=class extends xr{constructor(e){super(),this.isMeshDepthMaterial=!0,this.type="MeshDepthMaterial",this.depthPacking=vv,this.map=null,this.alphaMap=null,this.displacementMap=null,this.displacementScale=1,this.displacementBias=0,this.wireframe=!1,this.wireframeLinewidth=1,this.setValues(e)}copy(e){return super.copy(e),this.depthPacking=e.depthPacking,this.map=e.map,this.alphaMap=e.alphaMap,this.displacementMap=e.displacementMap,this.displacementScale=e.displacementScale,this.displacementBias=e.displacementBias,this.wireframe=e.wireframe,this.wireframeLinewidth=e.wireframeLinewidth,this}},Dh=class extends xr{constructor(e){super(),this.isMeshDistanceMaterial=!0,this.type="MeshDistanceMaterial",this.map=null,this.alphaMap=null,this.displacementMap=null,this.displacementScale=1,this.displacementBias=0,this.setValues(e)}copy(e){return super.copy(e),this.map=e.map,this.alphaMap=e.alphaMap,this.displacementMap=e.displacementMap,this.displacementScale=e.displacementScale,this.displacementBias=e.displacementBias,this}};function za(n,e){return!n||n.constructor===e?n:typeof e.BYTES_PER_ELEMENT=="number"?new e(n):Array.prototype.slice.call(n)}function ch(n){return n!==void 0&&n.inTangents!==void 0&&n.outTangents!==void 0}var Jr=class{constructor(e,t,i,s){this.parameterPositions=e,this._cachedIndex=0,this.resultBuffer=s!==void 0?s:new t.constructor(i),this.sampleValues=t,this.valueSize=i,this.settings=null,this.DefaultSettings_={}}evaluate(e){let t=this.parameterPositions,i=this._cachedIndex,s=t[i],r=t[i-1];e:{t:{let o;n:{i:if(!(e<s)){for(let a=i+2;;){if(s===void 0){if(e<r)break i;return i=t.length,this._cachedIndex=i,this.copySampleValue_(i-1)}if(i===a)break;if(r=s,s=t[++i],e<s)break t}o=t.length;break n}if(!(e>=r)){let a=t[1];e<a&&(i=2,r=a);for(let l=i-2;;){if(r===void 0)return this._cachedIndex=0,this.copySampleValue_(0);if(i===l)break;if(s=r,r=t[--i-1],e>=r)break t}o=i,i=0;break n}break e}for(;i<o;){let a=i+o>>>1;e<t[a]?o=a:i=a+1}if(s=t[i],r=t[i-1],r===void 0)return this._cachedIndex=0,this.copySampleValue_(0);if(s===void 0)return i=t.length,this._cachedIndex=i,this.copySampleValue_(i-1)}this._cachedIndex=i,this.intervalChanged_(i,r,s)}return this.interpolate_(i,r,e,s)}getSettings_(){return this.settings||this.DefaultSettings_}copySampleValue_(e){let t=this.resultBuffer,i=this.sampleValues,s=this.valueSize,r=e*s;for(let o=0;o!==s;++o)t[o]=i[r+o];return t}interpolate_(){throw new Error("THREE.Interpolant: Call to abstract method.")}intervalChanged_(){}},Nh=class extends Jr{constructor(e,t,i,s){super(e,t,i,s),this._weightPrev=-0,this._offsetPrev=-0,this._weightNext=-0,this._offsetNext=-0,this.DefaultSettings_={endingStart:Zp,endingEnd:Zp}}intervalChanged_(e,t,i){let s=this.parameterPositions,r=e-2,o=e+1,a=s[r],l=s[o];if(a===void 0)switch(this.getSettings_().endingStart){case Jp:r=e,a=2*t-i;break;case Kp:r=s.length-2,a=t+s[r]-s[r+1];break;default:r=e,a=i}if(l===void 0)switch(this.getSettings_().endingEnd){case Jp:o=e,l=2*i-t;break;case Kp:o=1,l=i+s[1]-s[0];break;default:o=e-1,l=t}let c=(i-t)*.5,u=this.valueSize;this._weightPrev=c/(t-a),this._weightNext=c/(l-i),this._offsetPrev=r*u,this._offsetNext=o*u}interpolate_(e,t,i,s){let r=this.resultBuffer,o=this.sampleValues,a=this.valueSize,l=e*a,c=l-a,u=this._offsetPrev,h=this._offsetNext,d=this._weightPrev,f=this._weightNext,m=(i-t)/(s-t),y=m*m,g=y*m,p=-d*g+2*d*y-d*m,x=(1+d)*g+(-1.5-2*d)*y+(-.5+d)*m+1,T=(-1-f)*g+(1.5+f)*y+.5*m,b=f*g-f*y;for(let R=0;R!==a;++R)r[R]=p*o[u+R]+x*o[c+R]+T*o[l+R]+b*o[h+R];return r}},Uh=class extends Jr{constructor(e,t,i,s){super(e,t,i,s)}interpolate_(e,t,i,s){let r=this.resultBuffer,o=this.sampleValues,a=this.valueSize,l=e*a,c=l-a,u=(i-t)/(s-t),h=1-u;for(let d=0;d!==a;++d)r[d]=o[c+d]*h+o[l+d]*u;return r}},Oh=class extends Jr{constructor(e,t,i,s){super(e,t,i,s)}interpolate_(e){return this.copySampleValue_(e-1)}},Fh=class extends Jr{interpolate_(e,t,i,s){let r=this.resultBuffer,o=this.sampleValues,a=this.valueSize,l=e*a,c=l-a,u=this.inTangents,h=this.outTangents;if(!u||!h){let m=(i-t)/(s-t),y=1-m;for(let g=0;g!==a;++g)r[g]=o[c+g]*y+o[l+g]*m;return r}let d=a*2,f=e-1;for(let m=0;m!==a;++m){let y=o[c+m],g=o[l+m],p=f*d+m*2,x=h[p],T=h[p+1],b=e*d+m*2,R=u[b],A=u[b+1],v=Rw(i,t,x,R,s);r[m]=Iv(v,y,T,A,g)}return r}};function Iv(n,e,t,i,s){let r=1-n;return r*r*r*e+3*r*r*n*t+3*r*n*n*i+n*n*n*s}function Cw(n,e,t,i,s){let r=1-n;return 3*r*r*(t-e)+6*r*n*(i-t)+3*n*n*(s-i)}function Rw(n,e,t,i,s){let r=(n-e)/(s-e);for(let o=0;o<8;o++){let a=Iv(r,e,t,i,s)-n;if(Math.abs(a)<1e-10)break;let l=Cw(r,e,t,i,s);if(Math.abs(l)<1e-10)break;r=Math.max(0,Math.min(1,r-a/l))}return r}var qi=class{constructor(e,t,i,s){if(e===void 0)throw new Error("THREE.KeyframeTrack: track name is undefined");if(t===void 0||t.length===0)throw new Error("THREE.KeyframeTrack: no keyframes in track named "+e);this.name=e,this.times=za(t,this.TimeBufferType),this.values=za(i,this.ValueBufferType),this.setInterpolation(s||this.DefaultInterpolation)}static toJSON(e){let t=e.constructor,i;if(t.toJSON!==this.toJSON)i=t.toJSON(e);else{i={name:e.name,times:za(e.times,Array),values:za(e.values,Array)};let s=e.getInterpolation();s!==e.DefaultInterpolation&&(i.interpolation=s),ch(e.settings)&&(i.settings={inTangents:za(e.settings.inTangents,Array),outTangents:za(e.settings.outTangents,Array)})}return i.type=e.ValueTypeName,i}InterpolantFactoryMethodDiscrete(e){return new Oh(this.times,this.values,this.getValueSize(),e)}InterpolantFactoryMethodLinear(e){return new Uh(this.times,this.values,this.getValueSize(),e)}InterpolantFactoryMethodSmooth(e){return new Nh(this.times,this.values,this.getValueSize(),e)}InterpolantFactoryMethodBezier(e){let t=new Fh(this.times,this.values,this.getValueSize(),e);return this.settings&&(t.inTangents=this.settings.inTangents,t.outTangents=this.settings.outTangents),t}setInterpolation(e){let t;switch(e){case hc:t=this.InterpolantFactoryMethodDiscrete;break;case Mh:t=this.InterpolantFactoryMethodLinear;break;case fh:t=this.InterpolantFactoryMethodSmooth;break;case jp:t=this.InterpolantFactoryMethodBezier;break}if(t===void 0){let i="unsupported interpolation for "+this.ValueTypeName+" keyframe track named "+this.name;if(this.createInterpolant===void 0)if(e!==this.DefaultInterpolation)this.setInterpolation(this.DefaultInterpolation);else throw new Error(i);return Ze("KeyframeTrack:",i),this}return this.createInterpolant=t,this}getInterpolation(){switch(this.createInterpolant){case this.InterpolantFactoryMethodDiscrete:return hc;case this.InterpolantFactoryMethodLinear:return Mh;case this.InterpolantFactoryMethodSmooth:return fh;case this.InterpolantFactoryMethodBezier:return jp}}getValueSize(){return this.values.length/this.times.length}shift(e){if(e!==0){let t=this.times;for(let i=0,s=t.length;i!==s;++i)t[i]+=e;ch(this.settings)&&(V_(this.settings.inTangents,e),V_(this.settings.outTangents,e))}return this}scale(e){if(e!==1){let t=this.times;for(let i=0,s=t.length;i!==s;++i)t[i]*=e;ch(this.settings)&&(H_(this.settings.inTangents,e),H_(this.settings.outTangents,e))}return this}trim(e,t){let i=this.times,s=i.length,r=0,o=s-1;for(;r!==s&&i[r]<e;)++r;for(;o!==-1&&i[o]>t;)--o;if(++o,r!==0||o!==s){r>=o&&(o=Math.max(o,1),r=o-1);let a=this.getValueSize();this.times=i.slice(r,o),this.values=this.values.slice(r*a,o*a)}return this}validate(){let e=!0,t=this.getValueSize();t-Math.floor(t)!==0&&(tt("KeyframeTrack: Invalid value size in track.",this),e=!1);let i=this.times,s=this.values,r=i.length;r===0&&(tt("KeyframeTrack: Track is empty.",this),e=!1);let o=null;for(let a=0;a!==r;a++){let l=i[a];if(typeof l=="number"&&isNaN(l)){tt("KeyframeTrack: Time is not a valid number.",this,a,l),e=!1;break}if(o!==null&&o>l){tt("KeyframeTrack: Out of order keys.",this,a,l,o),e=!1;break}o=l}if(s!==void 0&&GM(s))for(let a=0,l=s.length;a!==l;++a){let c=s[a];if(isNaN(c)){tt("KeyframeTrack: Value is not a valid number.",this,a,c),e=!1;break}}return e}optimize(){let e=this.times.slice(),t=this.values.slice(),i=this.getValueSize(),s=this.getInterpolation()===fh,r=e.length-1,o=1;for(let a=1;a<r;++a){let l=!1,c=e[a],u=e[a+1];if(c!==u&&(a!==1||c!==e[0]))if(s)l=!0;else{let h=a*i,d=h-i,f=h+i;for(let m=0;m!==i;++m){let y=t[h+m];if(y!==t[d+m]||y!==t[f+m]){l=!0;break}}}if(l){if(a!==o){e[o]=e[a];let h=a*i,d=o*i;for(let f=0;f!==i;++f)t[d+f]=t[h+f]}++o}}if(r>0){e[o]=e[r];for(let a=r*i,l=o*i,c=0;c!==i;++c)t[l+c]=t[a+c];++o}return o!==e.length?(this.times=e.slice(0,o),this.values=t.slice(0,o*i)):(this.times=e,this.values=t),this}clone(){let e=this.times.slice(),t=this.values.slice(),i=this.constructor,s=new i(this.name,e,t);return s.createInterpolant=this.createInterpolant,ch(this.settings)&&(s.settings={inTangents:this.settings.inTangents.slice(),outTangents:this.settings.outTangents.slice()}),s}};function V_(n,e){for(let t=0,i=n.length;t!==i;t+=2)n[t]+=e}function H_(n,e){for(let t=0,i=n.length;t!==i;t+=2)n[t]*=e}qi.prototype.ValueTypeName="";qi.prototype.TimeBufferType=Float32Array;qi.prototype.ValueBufferType=Float32Array;qi.prototype.DefaultInterpolation=Mh;var Kr=class extends qi{constructor(e,t,i){super(e,t,i)}};Kr.prototype.ValueTypeName="bool";Kr.prototype.ValueBufferType=Array;Kr.prototype.DefaultInterpolation=hc;Kr.prototype.InterpolantFactoryMethodLinear=void 0;Kr.prototype.InterpolantFactoryMethodSmooth=void 0;var Bh=class extends qi{constructor(e,t,i,s){super(e,t,i,s)}};Bh.prototype.ValueTypeName="color";var kh=class extends qi{constructor(e,t,i,s){super(e,t,i,s)}};kh.prototype.ValueTypeName="number";var zh=class extends Jr{constructor(e,t,i,s){super(e,t,i,s)}interpolate_(e,t,i,s){let r=this.resultBuffer,o=this.sampleValues,a=this.valueSize,l=(i-t)/(s-t),c=e*a;for(let u=c+a;c!==u;c+=4)rs.slerpFlat(r,0,o,c-a,o,c,l);return r}},Pc=class extends qi{constructor(e,t,i,s){super(e,t,i,s)}InterpolantFactoryMethodLinear(e){return new zh(this.times,this.values,this.getValueSize(),e)}};Pc.prototype.ValueTypeName="quaternion";Pc.prototype.InterpolantFactoryMethodSmooth=void 0;var Qr=class extends qi{constructor(e,t,i){super(e,t,i)}};Qr.prototype.ValueTypeName="string";Qr.prototype.ValueBufferType=Array;Qr.prototype.DefaultInterpolation=hc;Qr.prototype.InterpolantFactoryMethodLinear=void 0;Qr.prototype.InterpolantFactoryMethodSmooth=void 0;var Vh=class extends qi{constructor(e,t,i,s){super(e,t,i,s)}};Vh.prototype.ValueTypeName="vector";var Hh=class{constructor(e,t,i){let s=this,r=!1,o=0,a=0,l,c=[];this.onStart=void 0,this.onLoad=e,this.onProgress=t,this.onError=i,this._abortController=null,this.itemStart=function(u){a++,r===!1&&s.onStart!==void 0&&s.onStart(u,o,a),r=!0},this.itemEnd=function(u){o++,s.onProgress!==void 0&&s.onProgress(u,o,a),o===a&&(r=!1,s.onLoad!==void 0&&s.onLoad())},this.itemError=function(u){s.onError!==void 0&&s.onError(u)},this.resolveURL=function(u){return u=u.normalize("NFC"),l?l(u):u},this.setURLModifier=function(u){return l=u,this},this.addHandler=function(u,h){return c.push(u,h),this},this.removeHandler=function(u){let h=c.indexOf(u);return h!==-1&&c.splice(h,2),this},this.getHandler=function(u){for(let h=0,d=c.length;h<d;h+=2){let f=c[h],m=c[h+1];if(f.global&&(f.lastIndex=0),f.test(u))return m}return null},this.abort=function(){return this.abortController.abort(),this._abortController=null,this}}get abortController(){return this._abortController||(this._abortController=new AbortController),this._abortController}},Lv=new Hh,$h=class{constructor(e){this.manager=e!==void 0?e:Lv,this.crossOrigin="anonymous",this.withCredentials=!1,this.path="",this.resourcePath="",this.requestHeader={},this.priority="auto",this.cache="default",typeof __THREE_DEVTOOLS__<"u"&&__THREE_DEVTOOLS__.dispatchEvent(new CustomEvent("observe",{detail:this}))}load(){}loadAsync(e,t){let i=this;return new Promise(function(s,r){i.load(e,s,t,r)})}parse(){}setCrossOrigin(e){return this.crossOrigin=e,this}setWithCredentials(e){return this.withCredentials=e,this}setPath(e){return this.path=e,this}setResourcePath(e){return this.resourcePath=e,this}setRequestHeader(e){return this.requestHeader=e,this}setPriority(e){return this.priority=e,this}setCache(e){return this.cache=e,this}abort(){return this}};$h.DEFAULT_MATERIAL_NAME="__DEFAULT";var Ic=class extends ti{static registerNode(e){this.prototype._lightNode=e}constructor(e,t=1){super(),this.isLight=!0,this.type="Light",this.color=new lt(e),this.intensity=t}copy(e,t){return super.copy(e,t),this.color.copy(e.color),this.intensity=e.intensity,this}toJSON(e){let t=super.toJSON(e);return t.object.color=this.color.getHex(),t.object.intensity=this.intensity,t}},Lc=class extends Ic{constructor(e,t,i){super(e,i),this.isHemisphereLight=!0,this.type="HemisphereLight",this.position.copy(ti.DEFAULT_UP),this.updateMatrix(),this.groundColor=new lt(t)}copy(e,t){return super.copy(e,t),this.groundColor.copy(e.groundColor),this}toJSON(e){let t=super.toJSON(e);return t.object.groundColor=this.groundColor.getHex(),t}},qp=new ht,$_=new B,G_=new B,Gh=class{constructor(e){this.camera=e,this.intensity=1,this.bias=0,this.biasNode=null,this.normalBias=0,this.radius=1,this.blurSamples=8,this.mapSize=new at(512,512),this.mapType=di,this.map=null,this.mapPass=null,this.matrix=new ht,this.autoUpdate=!0,this.needsUpdate=!1,this._frustum=new Gs,this._frameExtents=new at(1,1),this._viewportCount=1,this._viewports=[new It(0,0,1,1)]}getViewportCount(){return this._viewportCount}getCamera(){return this.camera}getFrustum(){return this._frustum}updateMatrices(e){let t=this.camera;$_.setFromMatrixPosition(e.matrixWorld),t.position.copy($_),G_.setFromMatrixPosition(e.target.matrixWorld),t.lookAt(G_),t.updateMatrixWorld(),this._updateMatrix(t,this.matrix,this._frustum)}_updateMatrix(e,t,i,s){qp.multiplyMatrices(e.projectionMatrix,e.matrixWorldInverse),i.setFromProjectionMatrix(qp,e.coordinateSystem,e.reversedDepth);let r=this._frameExtents,o=s?s.z/r.x:1,a=s?s.w/r.y:1,l=s?s.x/r.x:0,c=s?s.y/r.y:0;e.coordinateSystem===Ya||e.reversedDepth?t.set(.5*o,0,0,.5*o+l,0,.5*a,0,.5*a+c,0,0,1,0,0,0,0,1):t.set(.5*o,0,0,.5*o+l,0,.5*a,0,.5*a+c,0,0,.5,.5,0,0,0,1),t.multiply(qp)}getViewport(e){return this._viewports[e]}getFrameExtents(){return this._frameExtents}dispose(){this.map&&this.map.dispose(),this.mapPass&&this.mapPass.dispose()}copy(e){return this.camera=e.camera.clone(),this.intensity=e.intensity,this.bias=e.bias,this.radius=e.radius,this.autoUpdate=e.autoUpdate,this.needsUpdate=e.needsUpdate,this.normalBias=e.normalBias,this.blurSamples=e.blurSamples,this.mapSize.copy(e.mapSize),this.mapType=e.mapType,this.biasNode=e.biasNode,this}clone(){return new this.constructor().copy(this)}toJSON(){let e={};return e.intensity=this.intensity,e.bias=this.bias,e.normalBias=this.normalBias,e.radius=this.radius,e.blurSamples=this.blurSamples,e.mapSize=this.mapSize.toArray(),e.mapType=this.mapType,e.camera=this.camera.toJSON(!1).object,delete e.camera.matrix,e}},uh=new B,hh=new rs,zs=new B,ko=class extends ti{constructor(){super(),this.isCamera=!0,this.type="Camera",this.matrixWorldInverse=new ht,this.projectionMatrix=new ht,this.projectionMatrixInverse=new ht,this.coordinateSystem=is,this._reversedDepth=!1}get reversedDepth(){return this._reversedDepth}copy(e,t){return super.copy(e,t),this.matrixWorldInverse.copy(e.matrixWorldInverse),this.projectionMatrix.copy(e.projectionMatrix),this.projectionMatrixInverse.copy(e.projectionMatrixInverse),this.coordinateSystem=e.coordinateSystem,this}getWorldDirection(e){return super.getWorldDirection(e).negate()}updateMatrixWorld(e){super.updateMatrixWorld(e),this.matrixWorld.decompose(uh,hh,zs),zs.x===1&&zs.y===1&&zs.z===1?this.matrixWorldInverse.copy(this.matrixWorld).invert():this.matrixWorldInverse.compose(uh,hh,zs.set(1,1,1)).invert()}updateWorldMatrix(e,t,i=!1){super.updateWorldMatrix(e,t,i),this.matrixWorld.decompose(uh,hh,zs),zs.x===1&&zs.y===1&&zs.z===1?this.matrixWorldInverse.copy(this.matrixWorld).invert():this.matrixWorldInverse.compose(uh,hh,zs.set(1,1,1)).invert()}clone(){return new this.constructor().copy(this)}},jr=new B,W_=new at,X_=new at,Ei=class extends ko{constructor(e=50,t=1,i=.1,s=2e3){super(),this.isPerspectiveCamera=!0,this.type="PerspectiveCamera",this.fov=e,this.zoom=1,this.near=i,this.far=s,this.focus=10,this.aspect=t,this.view=null,this.filmGauge=35,this.filmOffset=0,this.updateProjectionMatrix()}copy(e,t){return super.copy(e,t),this.fov=e.fov,this.zoom=e.zoom,this.near=e.near,this.far=e.far,this.focus=e.focus,this.aspect=e.aspect,this.view=e.view===null?null:Object.assign({},e.view),this.filmGauge=e.filmGauge,this.filmOffset=e.filmOffset,this}setFocalLength(e){let t=.5*this.getFilmHeight()/e;this.fov=Za*2*Math.atan(t),this.updateProjectionMatrix()}getFocalLength(){let e=Math.tan(cc*.5*this.fov);return .5*this.getFilmHeight()/e}getEffectiveFOV(){return Za*2*Math.atan(Math.tan(cc*.5*this.fov)/this.zoom)}getFilmWidth(){return this.filmGauge*Math.min(this.aspect,1)}getFilmHeight(){return this.filmGauge/Math.max(this.aspect,1)}getViewBounds(e,t,i){jr.set(-1,-1,.5).applyMatrix4(this.projectionMatrixInverse),t.set(jr.x,jr.y).multiplyScalar(-e/jr.z),jr.set(1,1,.5).applyMatrix4(this.projectionMatrixInverse),i.set(jr.x,jr.y).multiplyScalar(-e/jr.z)}getViewSize(e,t){return this.getViewBounds(e,W_,X_),t.subVectors(X_,W_)}setViewOffset(e,t,i,s,r,o){this.aspect=e/t,this.view===null&&(this.view={enabled:!0,fullWidth:1,fullHeight:1,offsetX:0,offsetY:0,width:1,height:1}),this.view.enabled=!0,this.view.fullWidth=e,this.view.fullHeight=t,this.view.offsetX=i,this.view.offsetY=s,this.view.width=r,this.view.height=o,this.updateProjectionMatrix()}clearViewOffset(){this.view!==null&&(this.view.enabled=!1),this.updateProjectionMatrix()}updateProjectionMatrix(){let e=this.near,t=e*Math.tan(cc*.5*this.fov)/this.zoom,i=2*t,s=this.aspect*i,r=-.5*s,o=this.view;if(this.view!==null&&this.view.enabled){let l=o.fullWidth,c=o.fullHeight;r+=o.offsetX*s/l,t-=o.offsetY*i/c,s*=o.width/l,i*=o.height/c}let a=this.filmOffset;a!==0&&(r+=e*a/this.getFilmWidth()),this.projectionMatrix.makePerspective(r,r+s,t,t-i,e,this.far,this.coordinateSystem,this.reversedDepth),this.projectionMatrixInverse.copy(this.projectionMatrix).invert()}toJSON(e){let t=super.toJSON(e);return t.object.fov=this.fov,t.object.zoom=this.zoom,t.object.near=this.near,t.object.far=this.far,t.object.focus=this.focus,t.object.aspect=this.aspect,this.view!==null&&(t.object.view=Object.assign({},this.view)),t.object.filmGauge=this.filmGauge,t.object.filmOffset=this.filmOffset,t}};var zo=class extends ko{constructor(e=-1,t=1,i=1,s=-1,r=.1,o=2e3){super(),this.isOrthographicCamera=!0,this.type="OrthographicCamera",this.zoom=1,this.view=null,this.left=e,this.right=t,this.top=i,this.bottom=s,this.near=r,this.far=o,this.updateProjectionMatrix()}copy(e,t){return super.copy(e,t),this.left=e.left,this.right=e.right,this.top=e.top,this.bottom=e.bottom,this.near=e.near,this.far=e.far,this.zoom=e.zoom,this.view=e.view===null?null:Object.assign({},e.view),this}setViewOffset(e,t,i,s,r,o){this.view===null&&(this.view={enabled:!0,fullWidth:1,fullHeight:1,offsetX:0,offsetY:0,width:1,height:1}),this.view.enabled=!0,this.view.fullWidth=e,this.view.fullHeight=t,this.view.offsetX=i,this.view.offsetY=s,this.view.width=r,this.view.height=o,this.updateProjectionMatrix()}clearViewOffset(){this.view!==null&&(this.view.enabled=!1),this.updateProjectionMatrix()}updateProjectionMatrix(){let e=(this.right-this.left)/(2*this.zoom),t=(this.top-this.bottom)/(2*this.zoom),i=(this.right+this.left)/2,s=(this.top+this.bottom)/2,r=i-e,o=i+e,a=s+t,l=s-t;if(this.view!==null&&this.view.enabled){let c=(this.right-this.left)/this.view.fullWidth/this.zoom,u=(this.top-this.bottom)/this.view.fullHeight/this.zoom;r+=c*this.view.offsetX,o=r+c*this.view.width,a-=u*this.view.offsetY,l=a-u*this.view.height}this.projectionMatrix.makeOrthographic(r,o,a,l,this.near,this.far,this.coordinateSystem,this.reversedDepth),this.projectionMatrixInverse.copy(this.projectionMatrix).invert()}toJSON(e){let t=super.toJSON(e);return t.object.zoom=this.zoom,t.object.left=this.left,t.object.right=this.right,t.object.top=this.top,t.object.bottom=this.bottom,t.object.near=this.near,t.object.far=this.far,this.view!==null&&(t.object.view=Object.assign({},this.view)),t}},em=class extends Gh{constructor(){super(new zo(-5,5,5,-5,.5,500)),this.isDirectionalLightShadow=!0}},Dc=class extends Ic{constructor(e,t){super(e,t),this.isDirectionalLight=!0,this.type="DirectionalLight",this.position.copy(ti.DEFAULT_UP),this.updateMatrix(),this.target=new ti,this.shadow=new em}dispose(){super.dispose(),this.shadow.dispose()}copy(e){return super.copy(e),this.target=e.target.clone(),this.shadow=e.shadow.clone(),this}toJSON(e){let t=super.toJSON(e);return t.object.shadow=this.shadow.toJSON(),t.object.target=this.target.uuid,t}};var Nc=class extends Bn{constructor(){super(),this.isInstancedBufferGeometry=!0,this.type="InstancedBufferGeometry",this.instanceCount=1/0}copy(e){return super.copy(e),this.instanceCount=e.instanceCount,this}toJSON(){let e=super.toJSON();return e.instanceCount=this.instanceCount,e.isInstancedBufferGeometry=!0,e}};var Va=-90,Ha=1,tl=class extends ti{constructor(e,t,i){super(),this.type="CubeCamera",this.renderTarget=i,this.coordinateSystem=null,this.activeMipmapLevel=0;let s=new Ei(Va,Ha,e,t);s.layers=this.layers,this.add(s);let r=new Ei(Va,Ha,e,t);r.layers=this.layers,this.add(r);let o=new Ei(Va,Ha,e,t);o.layers=this.layers,this.add(o);let a=new Ei(Va,Ha,e,t);a.layers=this.layers,this.add(a);let l=new Ei(Va,Ha,e,t);l.layers=this.layers,this.add(l);let c=new Ei(Va,Ha,e,t);c.layers=this.layers,this.add(c)}updateCoordinateSystem(){let e=this.coordinateSystem,t=this.children.concat(),[i,s,r,o,a,l]=t;for(let c of t)this.remove(c);if(e===is)i.up.set(0,1,0),i.lookAt(1,0,0),s.up.set(0,1,0),s.lookAt(-1,0,0),r.up.set(0,0,-1),r.lookAt(0,1,0),o.up.set(0,0,1),o.lookAt(0,-1,0),a.up.set(0,1,0),a.lookAt(0,0,1),l.up.set(0,1,0),l.lookAt(0,0,-1);else if(e===Ya)i.up.set(0,-1,0),i.lookAt(-1,0,0),s.up.set(0,-1,0),s.lookAt(1,0,0),r.up.set(0,0,1),r.lookAt(0,1,0),o.up.set(0,0,-1),o.lookAt(0,-1,0),a.up.set(0,-1,0),a.lookAt(0,0,1),l.up.set(0,-1,0),l.lookAt(0,0,-1);else throw new Error("THREE.CubeCamera.updateCoordinateSystem(): Invalid coordinate system: "+e);for(let c of t)this.add(c),c.updateMatrixWorld()}update(e,t){this.parent===null&&this.updateMatrixWorld();let{renderTarget:i,activeMipmapLevel:s}=this;this.coordinateSystem!==e.coordinateSystem&&(this.coordinateSystem=e.coordinateSystem,this.updateCoordinateSystem());let[r,o,a,l,c,u]=this.children,h=e.getRenderTarget(),d=e.getActiveCubeFace(),f=e.getActiveMipmapLevel(),m=e.xr.enabled;e.xr.enabled=!1;let y=i.texture.mipmapsAutoUpdate;i.texture.mipmapsAutoUpdate=!1;let g=!1;e.isWebGLRenderer===!0?g=e.state.buffers.depth.getReversed():g=e.reversedDepthBuffer,e.setRenderTarget(i,0,s),g&&e.autoClear===!1&&e.clearDepth(),e.render(t,r),e.setRenderTarget(i,1,s),g&&e.autoClear===!1&&e.clearDepth(),e.render(t,o),e.setRenderTarget(i,2,s),g&&e.autoClear===!1&&e.clearDepth(),e.render(t,a),e.setRenderTarget(i,3,s),g&&e.autoClear===!1&&e.clearDepth(),e.render(t,l),e.setRenderTarget(i,4,s),g&&e.autoClear===!1&&e.clearDepth(),e.render(t,c),i.texture.mipmapsAutoUpdate=y,e.setRenderTarget(i,5,s),g&&e.autoClear===!1&&e.clearDepth(),e.render(t,u),e.setRenderTarget(h,d,f),e.xr.enabled=m,i.texture.needsPMREMUpdate=!0}},Wh=class extends Ei{constructor(e=[]){super(),this.isArrayCamera=!0,this.isMultiViewCamera=!1,this.cameras=e,this.perCameraFrustumCulled=!1}};var Dm="\\[\\]\\.:\\/",Pw=new RegExp("["+Dm+"]","g"),Nm="[^"+Dm+"]",Iw="[^"+Dm.replace("\\.","")+"]",Lw=/((?:WC+[\/:])*)/.source.replace("WC",Nm),Dw=/(WCOD+)?/.source.replace("WCOD",Iw),Nw=/(?:\.(WC+)(?:\[(.+)\])?)?/.source.replace("WC",Nm),Uw=/\.(WC+)(?:\[(.+)\])?/.source.replace("WC",Nm),Ow=new RegExp("^"+Lw+Dw+Nw+Uw+"$"),Fw=["material","materials","bones","map"],tm=class{constructor(e,t,i){let s=i||Qt.parseTrackName(t);this._targetGroup=e,this._bindings=e.subscribe_(t,s)}getValue(e,t){this.bind();let i=this._targetGroup.nCachedObjects_,s=this._bindings[i];s!==void 0&&s.getValue(e,t)}setValue(e,t){let i=this._bindings;for(let s=this._targetGroup.nCachedObjects_,r=i.length;s!==r;++s)i[s].setValue(e,t)}bind(){let e=this._bindings;for(let t=this._targetGroup.nCachedObjects_,i=e.length;t!==i;++t)e[t].bind()}unbind(){let e=this._bindings;for(let t=this._targetGroup.nCachedObjects_,i=e.length;t!==i;++t)e[t].unbind()}},Qt=class n{constructor(e,t,i){this.path=t,this.parsedPath=i||n.parseTrackName(t),this.node=n.findNode(e,this.parsedPath.nodeName),this.rootNode=e,this.getValue=this._getValue_unbound,this.setValue=this._setValue_unbound}static create(e,t,i){return e&&e.isAnimationObjectGroup?new n.Composite(e,t,i):new n(e,t,i)}static sanitizeNodeName(e){return e.replace(/\s/g,"_").replace(Pw,"")}static parseTrackName(e){let t=Ow.exec(e);if(t===null)throw new Error("THREE.PropertyBinding: Cannot parse trackName: "+e);let i={nodeName:t[2],objectName:t[3],objectIndex:t[4],propertyName:t[5],propertyIndex:t[6]},s=i.nodeName&&i.nodeName.lastIndexOf(".");if(s!==void 0&&s!==-1){let r=i.nodeName.substring(s+1);Fw.indexOf(r)!==-1&&(i.nodeName=i.nodeName.substring(0,s),i.objectName=r)}if(i.propertyName===null||i.propertyName.length===0)throw new Error("THREE.PropertyBinding: can not parse propertyName from trackName: "+e);return i}static findNode(e,t){if(t===void 0||t===""||t==="."||t===-1||t===e.name||t===e.uuid)return e;if(e.skeleton){let i=e.skeleton.getBoneByName(t);if(i!==void 0)return i}if(e.children){let i=function(r){for(let o=0;o<r.length;o++){let a=r[o];if(a.name===t||a.uuid===t)return a;let l=i(a.children);if(l)return l}return null},s=i(e.children);if(s)return s}return null}_getValue_unavailable(){}_setValue_unavailable(){}_getValue_direct(e,t){e[t]=this.targetObject[this.propertyName]}_getValue_array(e,t){let i=this.resolvedProperty;for(let s=0,r=i.length;s!==r;++s)e[t++]=i[s]}_getValue_arrayElement(e,t){e[t]=this.resolvedProperty[this.propertyIndex]}_getValue_toArray(e,t){this.resolvedProperty.toArray(e,t)}_setValue_direct(e,t){this.targetObject[this.propertyName]=e[t]}_setValue_direct_setNeedsUpdate(e,t){this.targetObject[this.propertyName]=e[t],this.targetObject.needsUpdate=!0}_setValue_direct_setMatrixWorldNeedsUpdate(e,t){this.targetObject[this.propertyName]=e[t],this.targetObject.matrixWorldNeedsUpdate=!0}_setValue_array(e,t){let i=this.resolvedProperty;for(let s=0,r=i.length;s!==r;++s)i[s]=e[t++]}_setValue_array_setNeedsUpdate(e,t){let i=this.resolvedProperty;for(let s=0,r=i.length;s!==r;++s)i[s]=e[t++];this.targetObject.needsUpdate=!0}_setValue_array_setMatrixWorldNeedsUpdate(e,t){let i=this.resolvedProperty;for(let s=0,r=i.length;s!==r;++s)i[s]=e[t++];this.targetObject.matrixWorldNeedsUpdate=!0}_setValue_arrayElement(e,t){this.resolvedProperty[this.propertyIndex]=e[t]}_setValue_arrayElement_setNeedsUpdate(e,t){this.resolvedProperty[this.propertyIndex]=e[t],this.targetObject.needsUpdate=!0}_setValue_arrayElement_setMatrixWorldNeedsUpdate(e,t){this.resolvedProperty[this.propertyIndex]=e[t],this.targetObject.matrixWorldNeedsUpdate=!0}_setValue_fromArray(e,t){this.resolvedProperty.fromArray(e,t)}_setValue_fromArray_setNeedsUpdate(e,t){this.resolvedProperty.fromArray(e,t),this.targetObject.needsUpdate=!0}_setValue_fromArray_setMatrixWorldNeedsUpdate(e,t){this.resolvedProperty.fromArray(e,t),this.targetObject.matrixWorldNeedsUpdate=!0}_getValue_unbound(e,t){this.bind(),this.getValue(e,t)}_setValue_unbound(e,t){this.bind(),this.setValue(e,t)}bind(){let e=this.node,t=this.parsedPath,i=t.objectName,s=t.propertyName,r=t.propertyIndex;if(e||(e=n.findNode(this.rootNode,t.nodeName),this.node=e),this.getValue=this._getValue_unavailable,this.setValue=this._setValue_unavailable,!e){Ze("PropertyBinding: No target node found for track: "+this.path+".");return}if(i){let c=t.objectIndex;switch(i){case"materials":if(!e.material){tt("PropertyBinding: Can not bind to material as node does not have a material.",this);return}if(!e.material.materials){tt("PropertyBinding: Can not bind to material.materials as node.material does not have a materials array.",this);return}e=e.material.materials;break;case"bones":if(!e.skeleton){tt("PropertyBinding: Can not bind to bones as node does not have a skeleton.",this);return}e=e.skeleton.bones;for(let u=0;u<e.length;u++)if(e[u].name===c){c=u;break}break;case"map":if("map"in e){e=e.map;break}if(!e.material){tt("PropertyBinding: Can not bind to material as node does not have a material.",this);return}if(!e.material.map){tt("PropertyBinding: Can not bind to material.map as node.material does not have a map.",this);return}e=e.material.map;break;default:if(e[i]===void 0){tt("PropertyBinding: Can not bind to objectName of node undefined.",this);return}e=e[i]}if(c!==void 0){if(e[c]===void 0){tt("PropertyBinding: Trying to bind to objectIndex of objectName, but is undefined.",this,e);return}e=e[c]}}let o=e[s];if(o===void 0){let c=t.nodeName;tt("PropertyBinding: Trying to update property for track: "+c+"."+s+" but it wasn't found.",e);return}let a=this.Versioning.None;this.targetObject=e,e.isMaterial===!0?a=this.Versioning.NeedsUpdate:e.isObject3D===!0&&(a=this.Versioning.MatrixWorldNeedsUpdate);let l=this.BindingType.Direct;if(r!==void 0){if(s==="morphTargetInfluences"){if(!e.geometry){tt("PropertyBinding: Can not bind to morphTargetInfluences because node does not have a geometry.",this);return}if(!e.geometry.morphAttributes){tt("PropertyBinding: Can not bind to morphTargetInfluences because node does not have a geometry.morphAttributes.",this);return}e.morphTargetDictionary[r]!==void 0&&(r=e.morphTargetDictionary[r])}l=this.BindingType.ArrayElement,this.resolvedProperty=o,this.propertyIndex=r}else o.fromArray!==void 0&&o.toArray!==void 0?(l=this.BindingType.HasFromToArray,this.resolvedProperty=o):Array.isArray(o)?(l=this.BindingType.EntireArray,this.resolvedProperty=o):this.propertyName=s;this.getValue=this.GetterByBindingType[l],this.setValue=this.SetterByBindingTypeAndVersioning[l][a]}unbind(){this.node=null,this.getValue=this._getValue_unbound,this.setValue=this._setValue_unbound}};Qt.Composite=tm;Qt.prototype.BindingType={Direct:0,EntireArray:1,ArrayElement:2,HasFromToArray:3};Qt.prototype.Versioning={None:0,NeedsUpdate:1,MatrixWorldNeedsUpdate:2};Qt.prototype.GetterByBindingType=[Qt.prototype._getValue_direct,Qt.prototype._getValue_array,Qt.prototype._getValue_arrayElement,Qt.prototype._getValue_toArray];Qt.prototype.SetterByBindingTypeAndVersioning=[[Qt.prototype._setValue_direct,Qt.prototype._setValue_direct_setNeedsUpdate,Qt.prototype._setValue_direct_setMatrixWorldNeedsUpdate],[Qt.prototype._setValue_array,Qt.prototype._setValue_array_setNeedsUpdate,Qt.prototype._setValue_array_setMatrixWorldNeedsUpdate],[Qt.prototype._setValue_arrayElement,Qt.prototype._setValue_arrayElement_setNeedsUpdate,Qt.prototype._setValue_arrayElement_setMatrixWorldNeedsUpdate],[Qt.prototype._setValue_fromArray,Qt.prototype._setValue_fromArray_setNeedsUpdate,Qt.prototype._setValue_fromArray_setMatrixWorldNeedsUpdate]];var jI=new Float32Array(1);var eo=class extends Ah{constructor(e,t,i=1){super(e,t),this.isInstancedInterleavedBuffer=!0,this.meshPerAttribute=i}copy(e){return super.copy(e),this.meshPerAttribute=e.meshPerAttribute,this}clone(e){let t=super.clone(e);return t.meshPerAttribute=this.meshPerAttribute,t}toJSON(e){let t=super.toJSON(e);return t.isInstancedInterleavedBuffer=!0,t.meshPerAttribute=this.meshPerAttribute,t}};var nm=class{static{this.prototype.isMatrix2=!0}constructor(e,t,i,s){this.elements=[1,0,0,1],e!==void 0&&this.set(e,t,i,s)}identity(){return this.set(1,0,0,1),this}fromArray(e,t=0){for(let i=0;i<4;i++)this.elements[i]=e[i+t];return this}set(e,t,i,s){let r=this.elements;return r[0]=e,r[2]=t,r[1]=i,r[3]=s,this}};var q_=new B,dh=new B,$a=new B,Ga=new B,Yp=new B,Bw=new B,kw=new B,Uc=class{constructor(e=new B,t=new B){this.start=e,this.end=t}set(e,t){return this.start.copy(e),this.end.copy(t),this}copy(e){return this.start.copy(e.start),this.end.copy(e.end),this}getCenter(e){return e.addVectors(this.start,this.end).multiplyScalar(.5)}delta(e){return e.subVectors(this.end,this.start)}distanceSq(){return this.start.distanceToSquared(this.end)}distance(){return this.start.distanceTo(this.end)}at(e,t){return this.delta(t).multiplyScalar(e).add(this.start)}closestPointToPointParameter(e,t){q_.subVectors(e,this.start),dh.subVectors(this.end,this.start);let i=dh.dot(dh);if(i===0)return 0;let r=dh.dot(q_)/i;return t&&(r=ut(r,0,1)),r}closestPointToPoint(e,t,i){let s=this.closestPointToPointParameter(e,t);return this.delta(i).multiplyScalar(s).add(this.start)}distanceSqToLine3(e,t=Bw,i=kw){let s=10000000000000001e-32,r,o,a=this.start,l=e.start,c=this.end,u=e.end;$a.subVectors(c,a),Ga.subVectors(u,l),Yp.subVectors(a,l);let h=$a.dot($a),d=Ga.dot(Ga),f=Ga.dot(Yp);if(h<=s&&d<=s)return t.copy(a),i.copy(l),t.distanceToSquared(i);if(h<=s)r=0,o=f/d,o=ut(o,0,1);else{let m=$a.dot(Yp);if(d<=s)o=0,r=ut(-m/h,0,1);else{let y=$a.dot(Ga),g=h*d-y*y;g!==0?r=ut((y*f-m*d)/g,0,1):r=0,o=(y*r+f)/d,o<0?(o=0,r=ut(-m/h,0,1)):o>1&&(o=1,r=ut((y-m)/h,0,1))}}return t.copy(a).addScaledVector($a,r),i.copy(l).addScaledVector(Ga,o),t.distanceToSquared(i)}applyMatrix4(e){return this.start.applyMatrix4(e),this.end.applyMatrix4(e),this}equals(e){return e.start.equals(this.start)&&e.end.equals(this.end)}clone(){return new this.constructor().copy(this)}};function Um(n,e,t,i){let s=zw(i);switch(t){case bm:return n*e;case Qh:return n*e/s.components*s.byteLength;case ed:return n*e/s.components*s.byteLength;case no:return n*e*2/s.components*s.byteLength;case td:return n*e*2/s.components*s.byteLength;case Sm:return n*e*3/s.components*s.byteLength;case Yi:return n*e*4/s.components*s.byteLength;case nd:return n*e*4/s.components*s.byteLength;case Bc:case kc:return Math.floor((n+3)/4)*Math.floor((e+3)/4)*8;case zc:case Vc:return Math.floor((n+3)/4)*Math.floor((e+3)/4)*16;case sd:case od:return Math.max(n,16)*Math.max(e,8)/4;case id:case rd:return Math.max(n,8)*Math.max(e,8)/2;case ad:case ld:case ud:case hd:return Math.floor((n+3)/4)*Math.floor((e+3)/4)*8;case cd:case Hc:case dd:return Math.floor((n+3)/4)*Math.floor((e+3)/4)*16;case fd:return Math.floor((n+3)/4)*Math.floor((e+3)/4)*16;case pd:return Math.floor((n+4)/5)*Math.floor((e+3)/4)*16;case md:return Math.floor((n+4)/5)*Math.floor((e+4)/5)*16;case gd:return Math.floor((n+5)/6)*Math.floor((e+4)/5)*16;case _d:return Math.floor((n+5)/6)*Math.floor((e+5)/6)*16;case vd:return Math.floor((n+7)/8)*Math.floor((e+4)/5)*16;case yd:return Math.floor((n+7)/8)*Math.floor((e+5)/6)*16;case xd:return Math.floor((n+7)/8)*Math.floor((e+7)/8)*16;case bd:return Math.floor((n+9)/10)*Math.floor((e+4)/5)*16;case Sd:return Math.floor((n+9)/10)*Math.floor((e+5)/6)*16;case Md:return Math.floor((n+9)/10)*Math.floor((e+7)/8)*16;case wd:return Math.floor((n+9)/10)*Math.floor((e+9)/10)*16;case Ed:return Math.floor((n+11)/12)*Math.floor((e+9)/10)*16;case Td:return Math.floor((n+11)/12)*Math.floor((e+11)/12)*16;case Ad:case Cd:case Rd:return Math.ceil(n/4)*Math.ceil(e/4)*16;case Pd:case Id:return Math.ceil(n/4)*Math.ceil(e/4)*8;case $c:case Ld:return Math.ceil(n/4)*Math.ceil(e/4)*16}throw new Error(`Unable to determine texture byte length for ${t} format.`)}function zw(n){switch(n){case di:case _m:return{byteLength:1,components:1};case rl:case vm:case As:return{byteLength:2,components:1};case Jh:case Kh:return{byteLength:2,components:4};case Ts:case Zh:case Oi:return{byteLength:4,components:1};case ym:case xm:return{byteLength:4,components:3}}throw new Error(`THREE.TextureUtils: Unknown texture type ${n}.`)}typeof __THREE_DEVTOOLS__<"u"&&__THREE_DEVTOOLS__.dispatchEvent(new CustomEvent("register",{detail:{revision:"187"}}));typeof window<"u"&&(window.__THREE__?Ze("WARNING: Multiple instances of Three.js being imported."):window.__THREE__="187");function ey(){let n=null,e=!1,t=null,i=null;function s(r,o){i=n.requestAnimationFrame(s),t(r,o)}return{start:function(){e!==!0&&t!==null&&n!==null&&(i=n.requestAnimationFrame(s),e=!0)},stop:function(){n!==null&&n.cancelAnimationFrame(i),e=!1},setAnimationLoop:function(r){t=r},setContext:function(r){n=r}}}function Hw(n){let e=new WeakMap;function t(a,l){let c=a.array,u=a.usage,h=c.byteLength,d=n.createBuffer();n.bindBuffer(l,d),n.bufferData(l,c,u),a.onUploadCallback();let f;if(c instanceof Float32Array)f=n.FLOAT;else if(typeof Float16Array<"u"&&c instanceof Float16Array)f=n.HALF_FLOAT;else if(c instanceof Uint16Array)a.isFloat16BufferAttribute?f=n.HALF_FLOAT:f=n.UNSIGNED_SHORT;else if(c instanceof Int16Array)f=n.SHORT;else if(c instanceof Uint32Array)f=n.UNSIGNED_INT;else if(c instanceof Int32Array)f=n.INT;else if(c instanceof Int8Array)f=n.BYTE;else if(c instanceof Uint8Array)f=n.UNSIGNED_BYTE;else if(c instanceof Uint8ClampedArray)f=n.UNSIGNED_BYTE;else throw new Error("THREE.WebGLAttributes: Unsupported buffer data format: "+c);return{buffer:d,type:f,bytesPerElement:c.BYTES_PER_ELEMENT,version:a.version,size:h}}function i(a,l,c){let u=l.array,h=l.updateRanges;if(n.bindBuffer(c,a),h.length===0)n.bufferSubData(c,0,u);else{h.sort((f,m)=>f.start-m.start);let d=0;for(let f=1;f<h.length;f++){let m=h[d],y=h[f];y.start<=m.start+m.count+1?m.count=Math.max(m.count,y.start+y.count-m.start):(++d,h[d]=y)}h.length=d+1;for(let f=0,m=h.length;f<m;f++){let y=h[f];n.bufferSubData(c,y.start*u.BYTES_PER_ELEMENT,u,y.start,y.count)}l.clearUpdateRanges()}l.onUploadCallback()}function s(a){return a.isInterleavedBufferAttribute&&(a=a.data),e.get(a)}function r(a){a.isInterleavedBufferAttribute&&(a=a.data);let l=e.get(a);l&&(n.deleteBuffer(l.buffer),e.delete(a))}function o(a,l){if(a.isInterleavedBufferAttribute&&(a=a.data),a.isGLBufferAttribute){let u=e.get(a);(!u||u.version<a.version)&&e.set(a,{buffer:a.buffer,type:a.type,bytesPerElement:a.elementSize,version:a.version});return}let c=e.get(a);if(c===void 0)e.set(a,t(a,l));else if(c.version<a.version){if(c.size!==a.array.byteLength)throw new Error("THREE.WebGLAttributes: The size of the buffer attribute's array buffer does not match the original size. Resizing buffer attributes is not supported.");i(c.buffer,a,l),c.version=a.version}}return{get:s,remove:r,update:o}}var $w=`#ifdef USE_ALPHAHASH
	if ( diffuseColor.a < getAlphaHashThreshold( vPosition ) ) discard;
#endif`,Gw=`#ifdef USE_ALPHAHASH
	const float ALPHA_HASH_SCALE = 0.05;
	float hash2D( vec2 value ) {
		return fract( 1.0e4 * sin( 17.0 * value.x + 0.1 * value.y ) * ( 0.1 + abs( sin( 13.0 * value.y + value.x ) ) ) );
	}
	float hash3D( vec3 value ) {
		return hash2D( vec2( hash2D( value.xy ), value.z ) );
	}
	float getAlphaHashThreshold( vec3 position ) {
		float maxDeriv = max(
			length( dFdx( position.xyz ) ),
			length( dFdy( position.xyz ) )
		);
		float pixScale = 1.0 / ( ALPHA_HASH_SCALE * maxDeriv );
		vec2 pixScales = vec2(
			exp2( floor( log2( pixScale ) ) ),
			exp2( ceil( log2( pixScale ) ) )
		);
		vec2 alpha = vec2(
			hash3D( floor( pixScales.x * position.xyz ) ),
			hash3D( floor( pixScales.y * position.xyz ) )
		);
		float lerpFactor = fract( log2( pixScale ) );
		float x = ( 1.0 - lerpFactor ) * alpha.x + lerpFactor * alpha.y;
		float a = min( lerpFactor, 1.0 - lerpFactor );
		vec3 cases = vec3(
			x * x / ( 2.0 * a * ( 1.0 - a ) ),
			( x - 0.5 * a ) / ( 1.0 - a ),
			1.0 - ( ( 1.0 - x ) * ( 1.0 - x ) / ( 2.0 * a * ( 1.0 - a ) ) )
		);
		float threshold = ( x < ( 1.0 - a ) )
			? ( ( x < a ) ? cases.x : cases.y )
			: cases.z;
		return clamp( threshold , 1.0e-6, 1.0 );
	}
#endif`,Ww=`#ifdef USE_ALPHAMAP
	diffuseColor.a *= texture2D( alphaMap, vAlphaMapUv ).g;
#endif`,Xw=`#ifdef USE_ALPHAMAP
	uniform sampler2D alphaMap;
#endif`,qw=`#ifdef USE_ALPHATEST
	#ifdef ALPHA_TO_COVERAGE
	diffuseColor.a = smoothstep( alphaTest, alphaTest + fwidth( diffuseColor.a ), diffuseColor.a );
	if ( diffuseColor.a == 0.0 ) discard;
	#else
	if ( diffuseColor.a < alphaTest ) discard;
	#endif
#endif`,Yw=`#ifdef USE_ALPHATEST
	uniform float alphaTest;
#endif`,jw=`#ifdef USE_AOMAP
	float ambientOcclusion = ( texture2D( aoMap, vAoMapUv ).r - 1.0 ) * aoMapIntensity + 1.0;
	reflectedLight.indirectDiffuse *= ambientOcclusion;
	#if defined( USE_CLEARCOAT ) 
		clearcoatSpecularIndirect *= ambientOcclusion;
	#endif
	#if defined( USE_SHEEN ) 
		sheenSpecularIndirect *= ambientOcclusion;
	#endif
	#if defined( USE_ENVMAP ) && defined( STANDARD )
		float dotNV = saturate( dot( geometryNormal, geometryViewDir ) );
		reflectedLight.indirectSpecular *= computeSpecularOcclusion( dotNV, ambientOcclusion, material.roughness );
	#endif
#endif`,Zw=`#ifdef USE_AOMAP
	uniform sampler2D aoMap;
	uniform float aoMapIntensity;
#endif`,Jw=`#ifdef USE_BATCHING
	#if ! defined( GL_ANGLE_multi_draw )
	#define gl_DrawID _gl_DrawID
	uniform int _gl_DrawID;
	#endif
	uniform highp sampler2D batchingTexture;
	uniform highp usampler2D batchingIdTexture;
	mat4 getBatchingMatrix( const in float i ) {
		int size = textureSize( batchingTexture, 0 ).x;
		int j = int( i ) * 4;
		int x = j % size;
		int y = j / size;
		vec4 v1 = texelFetch( batchingTexture, ivec2( x, y ), 0 );
		vec4 v2 = texelFetch( batchingTexture, ivec2( x + 1, y ), 0 );
		vec4 v3 = texelFetch( batchingTexture, ivec2( x + 2, y ), 0 );
		vec4 v4 = texelFetch( batchingTexture, ivec2( x + 3, y ), 0 );
		return mat4( v1, v2, v3, v4 );
	}
	float getIndirectIndex( const in int i ) {
		int size = textureSize( batchingIdTexture, 0 ).x;
		int x = i % size;
		int y = i / size;
		return float( texelFetch( batchingIdTexture, ivec2( x, y ), 0 ).r );
	}
#endif
#ifdef USE_BATCHING_COLOR
	uniform sampler2D batchingColorTexture;
	vec4 getBatchingColor( const in float i ) {
		int size = textureSize( batchingColorTexture, 0 ).x;
		int j = int( i );
		int x = j % size;
		int y = j / size;
		return texelFetch( batchingColorTexture, ivec2( x, y ), 0 );
	}
#endif`,Kw=`#ifdef USE_BATCHING
	mat4 batchingMatrix = getBatchingMatrix( getIndirectIndex( gl_DrawID ) );
#endif`,Qw=`vec3 transformed = vec3( position );
#ifdef USE_ALPHAHASH
	vPosition = vec3( position );
#endif`,e1=`vec3 objectNormal = vec3( normal );
#ifdef USE_TANGENT
	vec3 objectTangent = vec3( tangent.xyz );
#endif`,t1=`float G_BlinnPhong_Implicit( ) {
	return 0.25;
}
float D_BlinnPhong( const in float shininess, const in float dotNH ) {
	return RECIPROCAL_PI * ( shininess * 0.5 + 1.0 ) * pow( dotNH, shininess );
}
vec3 BRDF_BlinnPhong( const in vec3 lightDir, const in vec3 viewDir, const in vec3 normal, const in vec3 specularColor, const in float shininess ) {
	vec3 halfDir = normalize( lightDir + viewDir );
	float dotNH = saturate( dot( normal, halfDir ) );
	float dotVH = saturate( dot( viewDir, halfDir ) );
	vec3 F = F_Schlick( specularColor, 1.0, dotVH );
	float G = G_BlinnPhong_Implicit( );
	float D = D_BlinnPhong( shininess, dotNH );
	return F * ( G * D );
} // validated`,n1=`#ifdef USE_IRIDESCENCE
	const mat3 XYZ_TO_REC709 = mat3(
		 3.2404542, -0.9692660,  0.0556434,
		-1.5371385,  1.8760108, -0.2040259,
		-0.4985314,  0.0415560,  1.0572252
	);
	vec3 Fresnel0ToIor( vec3 fresnel0 ) {
		vec3 sqrtF0 = sqrt( fresnel0 );
		return ( vec3( 1.0 ) + sqrtF0 ) / ( vec3( 1.0 ) - sqrtF0 );
	}
	vec3 IorToFresnel0( vec3 transmittedIor, float incidentIor ) {
		return pow2( ( transmittedIor - vec3( incidentIor ) ) / ( transmittedIor + vec3( incidentIor ) ) );
	}
	float IorToFresnel0( float transmittedIor, float incidentIor ) {
		return pow2( ( transmittedIor - incidentIor ) / ( transmittedIor + incidentIor ));
	}
	vec3 evalSensitivity( float OPD, vec3 shift ) {
		float phase = 2.0 * PI * OPD * 1.0e-9;
		vec3 val = vec3( 5.4856e-13, 4.4201e-13, 5.2481e-13 );
		vec3 pos = vec3( 1.6810e+06, 1.7953e+06, 2.2084e+06 );
		vec3 var = vec3( 4.3278e+09, 9.3046e+09, 6.6121e+09 );
		vec3 xyz = val * sqrt( 2.0 * PI * var ) * cos( pos * phase + shift ) * exp( - pow2( phase ) * var );
		xyz.x += 9.7470e-14 * sqrt( 2.0 * PI * 4.5282e+09 ) * cos( 2.2399e+06 * phase + shift[ 0 ] ) * exp( - 4.5282e+09 * pow2( phase ) );
		xyz /= 1.0685e-7;
		vec3 rgb = XYZ_TO_REC709 * xyz;
		return rgb;
	}
	vec3 evalIridescence( float outsideIOR, float eta2, float cosTheta1, float thinFilmThickness, vec3 baseF0 ) {
		vec3 I;
		float iridescenceIOR = mix( outsideIOR, eta2, smoothstep( 0.0, 0.03, thinFilmThickness ) );
		float sinTheta2Sq = pow2( outsideIOR / iridescenceIOR ) * ( 1.0 - pow2( cosTheta1 ) );
		float cosTheta2Sq = 1.0 - sinTheta2Sq;
		if ( cosTheta2Sq < 0.0 ) {
			return vec3( 1.0 );
		}
		float cosTheta2 = sqrt( cosTheta2Sq );
		float R0 = IorToFresnel0( iridescenceIOR, outsideIOR );
		float R12 = F_Schlick( R0, 1.0, cosTheta1 );
		float T121 = 1.0 - R12;
		float phi12 = 0.0;
		if ( iridescenceIOR < outsideIOR ) phi12 = PI;
		float phi21 = PI - phi12;
		vec3 baseIOR = Fresnel0ToIor( clamp( baseF0, 0.0, 0.9999 ) );		vec3 R1 = IorToFresnel0( baseIOR, iridescenceIOR );
		vec3 R23 = F_Schlick( R1, 1.0, cosTheta2 );
		vec3 phi23 = vec3( 0.0 );
		if ( baseIOR[ 0 ] < iridescenceIOR ) phi23[ 0 ] = PI;
		if ( baseIOR[ 1 ] < iridescenceIOR ) phi23[ 1 ] = PI;
		if ( baseIOR[ 2 ] < iridescenceIOR ) phi23[ 2 ] = PI;
		float OPD = 2.0 * iridescenceIOR * thinFilmThickness * cosTheta2;
		vec3 phi = vec3( phi21 ) + phi23;
		vec3 R123 = clamp( R12 * R23, 1e-5, 0.9999 );
		vec3 r123 = sqrt( R123 );
		vec3 Rs = pow2( T121 ) * R23 / ( vec3( 1.0 ) - R123 );
		vec3 C0 = R12 + Rs;
		I = C0;
		vec3 Cm = Rs - T121;
		for ( int m = 1; m <= 2; ++ m ) {
			Cm *= r123;
			vec3 Sm = 2.0 * evalSensitivity( float( m ) * OPD, float( m ) * phi );
			I += Cm * Sm;
		}
		return max( I, vec3( 0.0 ) );
	}
#endif`,i1=`#ifdef USE_BUMPMAP
	uniform sampler2D bumpMap;
	uniform float bumpScale;
	vec2 dHdxy_fwd() {
		vec2 dSTdx = dFdx( vBumpMapUv );
		vec2 dSTdy = dFdy( vBumpMapUv );
		float Hll = bumpScale * texture2D( bumpMap, vBumpMapUv ).x;
		float dBx = bumpScale * texture2D( bumpMap, vBumpMapUv + dSTdx ).x - Hll;
		float dBy = bumpScale * texture2D( bumpMap, vBumpMapUv + dSTdy ).x - Hll;
		return vec2( dBx, dBy );
	}
	vec3 perturbNormalArb( vec3 surf_pos, vec3 surf_norm, vec2 dHdxy, float faceDirection ) {
		vec3 vSigmaX = normalize( dFdx( surf_pos.xyz ) );
		vec3 vSigmaY = normalize( dFdy( surf_pos.xyz ) );
		vec3 vN = surf_norm;
		vec3 R1 = cross( vSigmaY, vN );
		vec3 R2 = cross( vN, vSigmaX );
		float fDet = dot( vSigmaX, R1 ) * faceDirection;
		vec3 vGrad = sign( fDet ) * ( dHdxy.x * R1 + dHdxy.y * R2 );
		return normalize( abs( fDet ) * surf_norm - vGrad );
	}
#endif`,s1=`#if NUM_CLIPPING_PLANES > 0
	vec4 plane;
	#ifdef ALPHA_TO_COVERAGE
		float distanceToPlane, distanceGradient;
		float clipOpacity = 1.0;
		#pragma unroll_loop_start
		for ( int i = 0; i < UNION_CLIPPING_PLANES; i ++ ) {
			plane = clippingPlanes[ i ];
			distanceToPlane = - dot( vClipPosition, plane.xyz ) + plane.w;
			distanceGradient = fwidth( distanceToPlane ) / 2.0;
			clipOpacity *= smoothstep( - distanceGradient, distanceGradient, distanceToPlane );
			if ( clipOpacity == 0.0 ) discard;
		}
		#pragma unroll_loop_end
		#if UNION_CLIPPING_PLANES < NUM_CLIPPING_PLANES
			float unionClipOpacity = 1.0;
			#pragma unroll_loop_start
			for ( int i = UNION_CLIPPING_PLANES; i < NUM_CLIPPING_PLANES; i ++ ) {
				plane = clippingPlanes[ i ];
				distanceToPlane = - dot( vClipPosition, plane.xyz ) + plane.w;
				distanceGradient = fwidth( distanceToPlane ) / 2.0;
				unionClipOpacity *= 1.0 - smoothstep( - distanceGradient, distanceGradient, distanceToPlane );
			}
			#pragma unroll_loop_end
			clipOpacity *= 1.0 - unionClipOpacity;
		#endif
		diffuseColor.a *= clipOpacity;
		if ( diffuseColor.a == 0.0 ) discard;
	#else
		#pragma unroll_loop_start
		for ( int i = 0; i < UNION_CLIPPING_PLANES; i ++ ) {
			plane = clippingPlanes[ i ];
			if ( dot( vClipPosition, plane.xyz ) > plane.w ) discard;
		}
		#pragma unroll_loop_end
		#if UNION_CLIPPING_PLANES < NUM_CLIPPING_PLANES
			bool clipped = true;
			#pragma unroll_loop_start
			for ( int i = UNION_CLIPPING_PLANES; i < NUM_CLIPPING_PLANES; i ++ ) {
				plane = clippingPlanes[ i ];
				clipped = ( dot( vClipPosition, plane.xyz ) > plane.w ) && clipped;
			}
			#pragma unroll_loop_end
			if ( clipped ) discard;
		#endif
	#endif
#endif`,r1=`#if NUM_CLIPPING_PLANES > 0
	varying vec3 vClipPosition;
	uniform vec4 clippingPlanes[ NUM_CLIPPING_PLANES ];
#endif`,o1=`#if NUM_CLIPPING_PLANES > 0
	varying vec3 vClipPosition;
#endif`,a1=`#if NUM_CLIPPING_PLANES > 0
	vClipPosition = - mvPosition.xyz;
#endif`,l1=`#if defined( USE_COLOR ) || defined( USE_COLOR_ALPHA )
	diffuseColor *= vColor;
#endif`,c1=`#if defined( USE_COLOR ) || defined( USE_COLOR_ALPHA )
	varying vec4 vColor;
#endif`,u1=`#if defined( USE_COLOR ) || defined( USE_COLOR_ALPHA ) || defined( USE_INSTANCING_COLOR ) || defined( USE_BATCHING_COLOR )
	varying vec4 vColor;
#endif`,h1=`#if defined( USE_COLOR ) || defined( USE_COLOR_ALPHA ) || defined( USE_INSTANCING_COLOR ) || defined( USE_BATCHING_COLOR )
	vColor = vec4( 1.0 );
#endif
#ifdef USE_COLOR_ALPHA
	vColor *= color;
#elif defined( USE_COLOR )
	vColor.rgb *= color;
#endif
#ifdef USE_INSTANCING_COLOR
	vColor.rgb *= instanceColor.rgb;
#endif
#ifdef USE_BATCHING_COLOR
	vColor *= getBatchingColor( getIndirectIndex( gl_DrawID ) );
#endif`,d1=`#define PI 3.141592653589793
#define PI2 6.283185307179586
#define PI_HALF 1.5707963267948966
#define RECIPROCAL_PI 0.3183098861837907
#define RECIPROCAL_PI2 0.15915494309189535
#define EPSILON 1e-6
#ifndef saturate
#define saturate( a ) clamp( a, 0.0, 1.0 )
#endif
#define whiteComplement( a ) ( 1.0 - saturate( a ) )
float pow2( const in float x ) { return x*x; }
vec3 pow2( const in vec3 x ) { return x*x; }
float pow3( const in float x ) { return x*x*x; }
float pow4( const in float x ) { float x2 = x*x; return x2*x2; }
float max3( const in vec3 v ) { return max( max( v.x, v.y ), v.z ); }
float average( const in vec3 v ) { return dot( v, vec3( 0.3333333 ) ); }
highp float rand( const in vec2 uv ) {
	const highp float a = 12.9898, b = 78.233, c = 43758.5453;
	highp float dt = dot( uv.xy, vec2( a,b ) ), sn = mod( dt, PI );
	return fract( sin( sn ) * c );
}
#ifdef HIGH_PRECISION
	float precisionSafeLength( vec3 v ) { return length( v ); }
#else
	float precisionSafeLength( vec3 v ) {
		float maxComponent = max3( abs( v ) );
		return length( v / maxComponent ) * maxComponent;
	}
#endif
struct IncidentLight {
	vec3 color;
	vec3 direction;
	bool visible;
};
struct ReflectedLight {
	vec3 directDiffuse;
	vec3 directSpecular;
	vec3 indirectDiffuse;
	vec3 indirectSpecular;
};
#ifdef USE_ALPHAHASH
	varying vec3 vPosition;
#endif
vec3 transformDirection( in vec3 dir, in mat4 matrix ) {
	return normalize( ( matrix * vec4( dir, 0.0 ) ).xyz );
}
#define inverseTransformDirection transformDirectionByInverseViewMatrix
vec3 transformNormalByInverseViewMatrix( in vec3 normal, in mat4 viewMatrix ) {
	return normalize( ( vec4( normal, 0.0 ) * viewMatrix ).xyz );
}
vec3 transformDirectionByInverseViewMatrix( in vec3 dir, in mat4 viewMatrix ) {
	return normalize( ( vec4( dir, 0.0 ) * viewMatrix ).xyz );
}
bool isPerspectiveMatrix( mat4 m ) {
	return m[ 2 ][ 3 ] == - 1.0;
}
vec2 equirectUv( in vec3 dir ) {
	float u = atan( dir.z, dir.x ) * RECIPROCAL_PI2 + 0.5;
	float v = asin( clamp( dir.y, - 1.0, 1.0 ) ) * RECIPROCAL_PI + 0.5;
	return vec2( u, v );
}
vec3 BRDF_Lambert( const in vec3 diffuseColor ) {
	return RECIPROCAL_PI * diffuseColor;
}
vec3 F_Schlick( const in vec3 f0, const in float f90, const in float dotVH ) {
	float fresnel = exp2( ( - 5.55473 * dotVH - 6.98316 ) * dotVH );
	return f0 * ( 1.0 - fresnel ) + ( f90 * fresnel );
}
float F_Schlick( const in float f0, const in float f90, const in float dotVH ) {
	float fresnel = exp2( ( - 5.55473 * dotVH - 6.98316 ) * dotVH );
	return f0 * ( 1.0 - fresnel ) + ( f90 * fresnel );
} // validated`,f1=`vec3 transformedNormal = objectNormal;
#ifdef USE_TANGENT
	vec3 transformedTangent = objectTangent;
#endif
#ifdef USE_BATCHING
	mat3 bm = mat3( batchingMatrix );
	transformedNormal /= vec3( dot( bm[ 0 ], bm[ 0 ] ), dot( bm[ 1 ], bm[ 1 ] ), dot( bm[ 2 ], bm[ 2 ] ) );
	transformedNormal = bm * transformedNormal;
	#ifdef USE_TANGENT
		transformedTangent = bm * transformedTangent;
	#endif
#endif
#ifdef USE_INSTANCING
	mat3 im = mat3( instanceMatrix );
	transformedNormal /= vec3( dot( im[ 0 ], im[ 0 ] ), dot( im[ 1 ], im[ 1 ] ), dot( im[ 2 ], im[ 2 ] ) );
	transformedNormal = im * transformedNormal;
	#ifdef USE_TANGENT
		transformedTangent = im * transformedTangent;
	#endif
#endif
transformedNormal = normalMatrix * transformedNormal;
#ifdef FLIP_SIDED
	transformedNormal = - transformedNormal;
#endif
#ifdef USE_TANGENT
	transformedTangent = ( modelViewMatrix * vec4( transformedTangent, 0.0 ) ).xyz;
#endif`,p1=`#ifdef USE_DISPLACEMENTMAP
	uniform sampler2D displacementMap;
	uniform float displacementScale;
	uniform float displacementBias;
#endif`,m1=`#ifdef USE_DISPLACEMENTMAP
	transformed += normalize( objectNormal ) * ( texture2D( displacementMap, vDisplacementMapUv ).x * displacementScale + displacementBias );
#endif`,g1=`#ifdef USE_EMISSIVEMAP
	vec4 emissiveColor = texture2D( emissiveMap, vEmissiveMapUv );
	#ifdef DECODE_VIDEO_TEXTURE_EMISSIVE
		emissiveColor = sRGBTransferEOTF( emissiveColor );
	#endif
	totalEmissiveRadiance *= emissiveColor.rgb;
#endif`,_1=`#ifdef USE_EMISSIVEMAP
	uniform sampler2D emissiveMap;
#endif`,v1="gl_FragColor = linearToOutputTexel( gl_FragColor );",y1=`vec4 LinearTransferOETF( in vec4 value ) {
	return value;
}
vec4 sRGBTransferEOTF( in vec4 value ) {
	return vec4( mix( pow( value.rgb * 0.9478672986 + vec3( 0.0521327014 ), vec3( 2.4 ) ), value.rgb * 0.0773993808, vec3( lessThanEqual( value.rgb, vec3( 0.04045 ) ) ) ), value.a );
}
vec4 sRGBTransferOETF( in vec4 value ) {
	return vec4( mix( pow( value.rgb, vec3( 0.41666 ) ) * 1.055 - vec3( 0.055 ), value.rgb * 12.92, vec3( lessThanEqual( value.rgb, vec3( 0.0031308 ) ) ) ), value.a );
}`,x1=`#ifdef USE_ENVMAP
	#ifdef ENV_WORLDPOS
		vec3 cameraToFrag;
		if ( isOrthographic ) {
			cameraToFrag = normalize( vec3( - viewMatrix[ 0 ][ 2 ], - viewMatrix[ 1 ][ 2 ], - viewMatrix[ 2 ][ 2 ] ) );
		} else {
			cameraToFrag = normalize( vWorldPosition - cameraPosition );
		}
		vec3 worldNormal = transformNormalByInverseViewMatrix( normal, viewMatrix );
		#ifdef ENVMAP_MODE_REFLECTION
			vec3 reflectVec = reflect( cameraToFrag, worldNormal );
		#else
			vec3 reflectVec = refract( cameraToFrag, worldNormal, refractionRatio );
		#endif
	#else
		vec3 reflectVec = vReflect;
	#endif
	#ifdef ENVMAP_TYPE_CUBE
		vec4 envColor = textureCube( envMap, envMapRotation * reflectVec );
		#ifdef ENVMAP_BLENDING_MULTIPLY
			outgoingLight = mix( outgoingLight, outgoingLight * envColor.xyz, specularStrength * reflectivity );
		#elif defined( ENVMAP_BLENDING_MIX )
			outgoingLight = mix( outgoingLight, envColor.xyz, specularStrength * reflectivity );
		#elif defined( ENVMAP_BLENDING_ADD )
			outgoingLight += envColor.xyz * specularStrength * reflectivity;
		#endif
	#endif
#endif`,b1=`#ifdef USE_ENVMAP
	uniform float envMapIntensity;
	uniform mat3 envMapRotation;
	uniform samplerCube envMap;
	#ifdef ENVMAP_TYPE_PMREM
		float roughnessToMip( const in float roughness ) {
			float r = clamp( roughness, 0.0, 1.0 );
			return ENVMAP_MAX_LOD * r * ( 2.0 - r );
		}
	#endif
#endif`,S1=`#ifdef USE_ENVMAP
	uniform float reflectivity;
	#if defined( USE_BUMPMAP ) || defined( USE_NORMALMAP ) || defined( PHONG ) || defined( LAMBERT )
		#define ENV_WORLDPOS
	#endif
	#ifdef ENV_WORLDPOS
		varying vec3 vWorldPosition;
		uniform float refractionRatio;
	#else
		varying vec3 vReflect;
	#endif
#endif`,M1=`#ifdef USE_ENVMAP
	#if defined( USE_BUMPMAP ) || defined( USE_NORMALMAP ) || defined( PHONG ) || defined( LAMBERT )
		#define ENV_WORLDPOS
	#endif
	#ifdef ENV_WORLDPOS
		
		varying vec3 vWorldPosition;
	#else
		varying vec3 vReflect;
		uniform float refractionRatio;
	#endif
#endif`,w1=`#ifdef USE_ENVMAP
	#ifdef ENV_WORLDPOS
		vWorldPosition = worldPosition.xyz;
	#else
		vec3 cameraToVertex;
		if ( isOrthographic ) {
			cameraToVertex = normalize( vec3( - viewMatrix[ 0 ][ 2 ], - viewMatrix[ 1 ][ 2 ], - viewMatrix[ 2 ][ 2 ] ) );
		} else {
			cameraToVertex = normalize( worldPosition.xyz - cameraPosition );
		}
		vec3 worldNormal = transformNormalByInverseViewMatrix( transformedNormal, viewMatrix );
		#ifdef ENVMAP_MODE_REFLECTION
			vReflect = reflect( cameraToVertex, worldNormal );
		#else
			vReflect = refract( cameraToVertex, worldNormal, refractionRatio );
		#endif
	#endif
#endif`,E1=`#ifdef USE_FOG
	vFogDepth = - mvPosition.z;
#endif`,T1=`#ifdef USE_FOG
	varying float vFogDepth;
#endif`,A1=`#ifdef USE_FOG
	#ifdef FOG_EXP2
		float fogFactor = 1.0 - exp( - fogDensity * fogDensity * vFogDepth * vFogDepth );
	#else
		float fogFactor = smoothstep( fogNear, fogFar, vFogDepth );
	#endif
	gl_FragColor.rgb = mix( gl_FragColor.rgb, fogColor, fogFactor );
#endif`,C1=`#ifdef USE_FOG
	uniform vec3 fogColor;
	varying float vFogDepth;
	#ifdef FOG_EXP2
		uniform float fogDensity;
	#else
		uniform float fogNear;
		uniform float fogFar;
	#endif
#endif`,R1=`#ifdef USE_GRADIENTMAP
	uniform sampler2D gradientMap;
#endif
vec3 getGradientIrradiance( vec3 normal, vec3 lightDirection ) {
	float dotNL = dot( normal, lightDirection );
	vec2 coord = vec2( dotNL * 0.5 + 0.5, 0.0 );
	#ifdef USE_GRADIENTMAP
		return vec3( texture2D( gradientMap, coord ).r );
	#else
		vec2 fw = fwidth( coord ) * 0.5;
		return mix( vec3( 0.7 ), vec3( 1.0 ), smoothstep( 0.7 - fw.x, 0.7 + fw.x, coord.x ) );
	#endif
}`,P1=`#ifdef USE_LIGHTMAP
	uniform sampler2D lightMap;
	uniform float lightMapIntensity;
#endif`,I1=`LambertMaterial material;
material.diffuseColor = diffuseColor.rgb;
material.specularStrength = specularStrength;`,L1=`varying vec3 vViewPosition;
struct LambertMaterial {
	vec3 diffuseColor;
	float specularStrength;
};
void RE_Direct_Lambert( const in IncidentLight directLight, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in LambertMaterial material, inout ReflectedLight reflectedLight ) {
	float dotNL = saturate( dot( geometryNormal, directLight.direction ) );
	vec3 irradiance = dotNL * directLight.color;
	reflectedLight.directDiffuse += irradiance * BRDF_Lambert( material.diffuseColor );
}
void RE_IndirectDiffuse_Lambert( const in vec3 irradiance, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in LambertMaterial material, inout ReflectedLight reflectedLight ) {
	reflectedLight.indirectDiffuse += irradiance * BRDF_Lambert( material.diffuseColor );
}
#define RE_Direct				RE_Direct_Lambert
#define RE_IndirectDiffuse		RE_IndirectDiffuse_Lambert`,D1=`uniform bool receiveShadow;
uniform vec3 ambientLightColor;
#if defined( USE_LIGHT_PROBES )
	uniform vec3 lightProbe[ 9 ];
#endif
vec3 shGetIrradianceAt( in vec3 normal, in vec3 shCoefficients[ 9 ] ) {
	float x = normal.x, y = normal.y, z = normal.z;
	vec3 result = shCoefficients[ 0 ] * 0.886227;
	result += shCoefficients[ 1 ] * 2.0 * 0.511664 * y;
	result += shCoefficients[ 2 ] * 2.0 * 0.511664 * z;
	result += shCoefficients[ 3 ] * 2.0 * 0.511664 * x;
	result += shCoefficients[ 4 ] * 2.0 * 0.429043 * x * y;
	result += shCoefficients[ 5 ] * 2.0 * 0.429043 * y * z;
	result += shCoefficients[ 6 ] * ( 0.743125 * z * z - 0.247708 );
	result += shCoefficients[ 7 ] * 2.0 * 0.429043 * x * z;
	result += shCoefficients[ 8 ] * 0.429043 * ( x * x - y * y );
	return result;
}
vec3 getLightProbeIrradiance( const in vec3 lightProbe[ 9 ], const in vec3 normal ) {
	vec3 worldNormal = transformNormalByInverseViewMatrix( normal, viewMatrix );
	vec3 irradiance = shGetIrradianceAt( worldNormal, lightProbe );
	return irradiance;
}
vec3 getAmbientLightIrradiance( const in vec3 ambientLightColor ) {
	vec3 irradiance = ambientLightColor;
	return irradiance;
}
float getDistanceAttenuation( const in float lightDistance, const in float cutoffDistance, const in float decayExponent ) {
	float distanceFalloff = 1.0 / max( pow( lightDistance, decayExponent ), 0.01 );
	if ( cutoffDistance > 0.0 ) {
		distanceFalloff *= pow2( saturate( 1.0 - pow4( lightDistance / cutoffDistance ) ) );
	}
	return distanceFalloff;
}
float getSpotAttenuation( const in float coneCosine, const in float penumbraCosine, const in float angleCosine ) {
	return smoothstep( coneCosine, penumbraCosine, angleCosine );
}
#if NUM_SUN_LIGHTS > 0
	struct SunLight {
		vec3 direction;
		vec3 color;
	};
	uniform SunLight sunLights[ NUM_SUN_LIGHTS ];
	void getSunLightInfo( const in SunLight sunLight, out IncidentLight light ) {
		light.color = sunLight.color;
		light.direction = sunLight.direction;
		light.visible = true;
	}
#endif
#if NUM_DIR_LIGHTS > 0
	struct DirectionalLight {
		vec3 direction;
		vec3 color;
	};
	uniform DirectionalLight directionalLights[ NUM_DIR_LIGHTS ];
	void getDirectionalLightInfo( const in DirectionalLight directionalLight, out IncidentLight light ) {
		light.color = directionalLight.color;
		light.direction = directionalLight.direction;
		light.visible = true;
	}
#endif
#if NUM_POINT_LIGHTS > 0
	struct PointLight {
		vec3 position;
		vec3 color;
		float distance;
		float decay;
	};
	uniform PointLight pointLights[ NUM_POINT_LIGHTS ];
	void getPointLightInfo( const in PointLight pointLight, const in vec3 geometryPosition, out IncidentLight light ) {
		vec3 lVector = pointLight.position - geometryPosition;
		light.direction = normalize( lVector );
		float lightDistance = length( lVector );
		light.color = pointLight.color;
		light.color *= getDistanceAttenuation( lightDistance, pointLight.distance, pointLight.decay );
		light.visible = ( light.color != vec3( 0.0 ) );
	}
#endif
#if NUM_SPOT_LIGHTS > 0
	struct SpotLight {
		vec3 position;
		vec3 direction;
		vec3 color;
		float distance;
		float decay;
		float coneCos;
		float penumbraCos;
	};
	uniform SpotLight spotLights[ NUM_SPOT_LIGHTS ];
	void getSpotLightInfo( const in SpotLight spotLight, const in vec3 geometryPosition, out IncidentLight light ) {
		vec3 lVector = spotLight.position - geometryPosition;
		light.direction = normalize( lVector );
		float angleCos = dot( light.direction, spotLight.direction );
		float spotAttenuation = getSpotAttenuation( spotLight.coneCos, spotLight.penumbraCos, angleCos );
		if ( spotAttenuation > 0.0 ) {
			float lightDistance = length( lVector );
			light.color = spotLight.color * spotAttenuation;
			light.color *= getDistanceAttenuation( lightDistance, spotLight.distance, spotLight.decay );
			light.visible = ( light.color != vec3( 0.0 ) );
		} else {
			light.color = vec3( 0.0 );
			light.visible = false;
		}
	}
#endif
#if NUM_RECT_AREA_LIGHTS > 0
	struct RectAreaLight {
		vec3 color;
		vec3 position;
		vec3 halfWidth;
		vec3 halfHeight;
	};
	uniform sampler2D ltc_1;	uniform sampler2D ltc_2;
	uniform RectAreaLight rectAreaLights[ NUM_RECT_AREA_LIGHTS ];
#endif
#if NUM_HEMI_LIGHTS > 0
	struct HemisphereLight {
		vec3 direction;
		vec3 skyColor;
		vec3 groundColor;
	};
	uniform HemisphereLight hemisphereLights[ NUM_HEMI_LIGHTS ];
	vec3 getHemisphereLightIrradiance( const in HemisphereLight hemiLight, const in vec3 normal ) {
		float dotNL = dot( normal, hemiLight.direction );
		float hemiDiffuseWeight = 0.5 * dotNL + 0.5;
		vec3 irradiance = mix( hemiLight.groundColor, hemiLight.skyColor, hemiDiffuseWeight );
		return irradiance;
	}
#endif
#include <lightprobes_pars_fragment>`,N1=`#ifdef USE_ENVMAP
	vec3 getIBLIrradiance( const in vec3 normal ) {
		#ifdef ENVMAP_TYPE_PMREM
			vec3 worldNormal = transformNormalByInverseViewMatrix( normal, viewMatrix );
			vec4 envMapColor = textureLod( envMap, envMapRotation * worldNormal, ENVMAP_MAX_LOD );
			return PI * envMapColor.rgb * envMapIntensity;
		#else
			return vec3( 0.0 );
		#endif
	}
	vec3 getIBLRadiance( const in vec3 viewDir, const in vec3 normal, const in float roughness ) {
		#ifdef ENVMAP_TYPE_PMREM
			vec3 reflectVec = reflect( - viewDir, normal );
			reflectVec = normalize( mix( reflectVec, normal, pow4( roughness ) ) );
			reflectVec = transformDirectionByInverseViewMatrix( reflectVec, viewMatrix );
			vec4 envMapColor = textureLod( envMap, envMapRotation * reflectVec, roughnessToMip( roughness ) );
			return envMapColor.rgb * envMapIntensity;
		#else
			return vec3( 0.0 );
		#endif
	}
	#ifdef USE_RETROREFLECTION
		vec3 getIBLRetroRadiance( const in vec3 viewDir, const in vec3 normal, const in float roughness ) {
			#ifdef ENVMAP_TYPE_PMREM
				vec3 retroVec = normalize( mix( viewDir, normal, pow4( roughness ) ) );
				retroVec = transformDirectionByInverseViewMatrix( retroVec, viewMatrix );
				vec4 envMapColor = textureLod( envMap, envMapRotation * retroVec, roughnessToMip( roughness ) );
				return envMapColor.rgb * envMapIntensity;
			#else
				return vec3( 0.0 );
			#endif
		}
	#endif
	#ifdef USE_ANISOTROPY
		vec3 getIBLAnisotropyRadiance( const in vec3 viewDir, const in vec3 normal, const in float roughness, const in vec3 bitangent, const in float anisotropy ) {
			#ifdef ENVMAP_TYPE_PMREM
				vec3 bentNormal = cross( bitangent, viewDir );
				bentNormal = normalize( cross( bentNormal, bitangent ) );
				bentNormal = normalize( mix( bentNormal, normal, pow2( pow2( 1.0 - anisotropy * ( 1.0 - roughness ) ) ) ) );
				return getIBLRadiance( viewDir, bentNormal, roughness );
			#else
				return vec3( 0.0 );
			#endif
		}
		#ifdef USE_RETROREFLECTION
			vec3 getIBLAnisotropyRetroRadiance( const in vec3 viewDir, const in vec3 normal, const in float roughness, const in vec3 bitangent, const in float anisotropy ) {
				#ifdef ENVMAP_TYPE_PMREM
					vec3 bentNormal = cross( bitangent, viewDir );
					bentNormal = normalize( cross( bentNormal, bitangent ) );
					bentNormal = normalize( mix( bentNormal, normal, pow2( pow2( 1.0 - anisotropy * ( 1.0 - roughness ) ) ) ) );
					return getIBLRetroRadiance( viewDir, bentNormal, roughness );
				#else
					return vec3( 0.0 );
				#endif
			}
		#endif
	#endif
#endif`,U1=`ToonMaterial material;
material.diffuseColor = diffuseColor.rgb;`,O1=`varying vec3 vViewPosition;
struct ToonMaterial {
	vec3 diffuseColor;
};
void RE_Direct_Toon( const in IncidentLight directLight, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in ToonMaterial material, inout ReflectedLight reflectedLight ) {
	vec3 irradiance = getGradientIrradiance( geometryNormal, directLight.direction ) * directLight.color;
	reflectedLight.directDiffuse += irradiance * BRDF_Lambert( material.diffuseColor );
}
void RE_IndirectDiffuse_Toon( const in vec3 irradiance, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in ToonMaterial material, inout ReflectedLight reflectedLight ) {
	reflectedLight.indirectDiffuse += irradiance * BRDF_Lambert( material.diffuseColor );
}
#define RE_Direct				RE_Direct_Toon
#define RE_IndirectDiffuse		RE_IndirectDiffuse_Toon`,F1=`BlinnPhongMaterial material;
material.diffuseColor = diffuseColor.rgb;
material.specularColor = specular;
material.specularShininess = shininess;
material.specularStrength = specularStrength;`,B1=`varying vec3 vViewPosition;
struct BlinnPhongMaterial {
	vec3 diffuseColor;
	vec3 specularColor;
	float specularShininess;
	float specularStrength;
};
void RE_Direct_BlinnPhong( const in IncidentLight directLight, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in BlinnPhongMaterial material, inout ReflectedLight reflectedLight ) {
	float dotNL = saturate( dot( geometryNormal, directLight.direction ) );
	vec3 irradiance = dotNL * directLight.color;
	reflectedLight.directDiffuse += irradiance * BRDF_Lambert( material.diffuseColor );
	reflectedLight.directSpecular += irradiance * BRDF_BlinnPhong( directLight.direction, geometryViewDir, geometryNormal, material.specularColor, material.specularShininess ) * material.specularStrength;
}
void RE_IndirectDiffuse_BlinnPhong( const in vec3 irradiance, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in BlinnPhongMaterial material, inout ReflectedLight reflectedLight ) {
	reflectedLight.indirectDiffuse += irradiance * BRDF_Lambert( material.diffuseColor );
}
#define RE_Direct				RE_Direct_BlinnPhong
#define RE_IndirectDiffuse		RE_IndirectDiffuse_BlinnPhong`,k1=`PhysicalMaterial material;
material.diffuseColor = diffuseColor.rgb;
material.diffuseContribution = diffuseColor.rgb * ( 1.0 - metalnessFactor );
material.metalness = metalnessFactor;
vec3 dxy = max( abs( dFdx( nonPerturbedNormal ) ), abs( dFdy( nonPerturbedNormal ) ) );
float geometryRoughness = max( max( dxy.x, dxy.y ), dxy.z );
material.roughness = max( roughnessFactor, 0.045 );
material.roughness += geometryRoughness;
material.roughness = min( material.roughness, 1.0 );
#ifdef USE_DIFFUSE_ROUGHNESS
	float diffuseRoughnessFactor = diffuseRoughness;
	#ifdef USE_DIFFUSE_ROUGHNESSMAP
		diffuseRoughnessFactor *= texture2D( diffuseRoughnessMap, vDiffuseRoughnessMapUv ).r;
	#endif
	material.diffuseRoughness = saturate( diffuseRoughnessFactor );
#endif
#ifdef IOR
	material.ior = ior;
	#ifdef USE_SPECULAR
		float specularIntensityFactor = specularIntensity;
		vec3 specularColorFactor = specularColor;
		#ifdef USE_SPECULAR_COLORMAP
			specularColorFactor *= texture2D( specularColorMap, vSpecularColorMapUv ).rgb;
		#endif
		#ifdef USE_SPECULAR_INTENSITYMAP
			specularIntensityFactor *= texture2D( specularIntensityMap, vSpecularIntensityMapUv ).a;
		#endif
		material.specularF90 = mix( specularIntensityFactor, 1.0, metalnessFactor );
	#else
		float specularIntensityFactor = 1.0;
		vec3 specularColorFactor = vec3( 1.0 );
		material.specularF90 = 1.0;
	#endif
	material.specularColor = min( pow2( ( material.ior - 1.0 ) / ( material.ior + 1.0 ) ) * specularColorFactor, vec3( 1.0 ) ) * specularIntensityFactor;
	material.specularColorBlended = mix( material.specularColor, diffuseColor.rgb, metalnessFactor );
#else
	material.specularColor = vec3( 0.04 );
	material.specularColorBlended = mix( material.specularColor, diffuseColor.rgb, metalnessFactor );
	material.specularF90 = 1.0;
#endif
#ifdef USE_CLEARCOAT
	material.clearcoat = clearcoat;
	material.clearcoatRoughness = clearcoatRoughness;
	material.clearcoatF0 = vec3( 0.04 );
	material.clearcoatF90 = 1.0;
	#ifdef USE_CLEARCOATMAP
		material.clearcoat *= texture2D( clearcoatMap, vClearcoatMapUv ).x;
	#endif
	#ifdef USE_CLEARCOAT_ROUGHNESSMAP
		material.clearcoatRoughness *= texture2D( clearcoatRoughnessMap, vClearcoatRoughnessMapUv ).y;
	#endif
	material.clearcoat = saturate( material.clearcoat );	material.clearcoatRoughness = max( material.clearcoatRoughness, 0.045 );
	material.clearcoatRoughness += geometryRoughness;
	material.clearcoatRoughness = min( material.clearcoatRoughness, 1.0 );
#endif
#ifdef USE_DISPERSION
	material.dispersion = dispersion;
#endif
#ifdef USE_RETROREFLECTION
	material.retroreflectivity = retroreflectivity;
#endif
#ifdef USE_IRIDESCENCE
	material.iridescence = iridescence;
	material.iridescenceIOR = iridescenceIOR;
	#ifdef USE_IRIDESCENCEMAP
		material.iridescence *= texture2D( iridescenceMap, vIridescenceMapUv ).r;
	#endif
	#ifdef USE_IRIDESCENCE_THICKNESSMAP
		material.iridescenceThickness = (iridescenceThicknessMaximum - iridescenceThicknessMinimum) * texture2D( iridescenceThicknessMap, vIridescenceThicknessMapUv ).g + iridescenceThicknessMinimum;
	#else
		material.iridescenceThickness = iridescenceThicknessMaximum;
	#endif
#endif
#ifdef USE_SHEEN
	material.sheenColor = sheenColor;
	#ifdef USE_SHEEN_COLORMAP
		material.sheenColor *= texture2D( sheenColorMap, vSheenColorMapUv ).rgb;
	#endif
	material.sheenRoughness = clamp( sheenRoughness, 0.0001, 1.0 );
	#ifdef USE_SHEEN_ROUGHNESSMAP
		material.sheenRoughness *= texture2D( sheenRoughnessMap, vSheenRoughnessMapUv ).a;
	#endif
#endif
#ifdef USE_ANISOTROPY
	#ifdef USE_ANISOTROPYMAP
		mat2 anisotropyMat = mat2( anisotropyVector.x, anisotropyVector.y, - anisotropyVector.y, anisotropyVector.x );
		vec3 anisotropyPolar = texture2D( anisotropyMap, vAnisotropyMapUv ).rgb;
		vec2 anisotropyV = anisotropyMat * normalize( 2.0 * anisotropyPolar.rg - vec2( 1.0 ) ) * anisotropyPolar.b;
	#else
		vec2 anisotropyV = anisotropyVector;
	#endif
	material.anisotropy = length( anisotropyV );
	if( material.anisotropy == 0.0 ) {
		anisotropyV = vec2( 1.0, 0.0 );
	} else {
		anisotropyV /= material.anisotropy;
		material.anisotropy = saturate( material.anisotropy );
	}
	material.alphaT = mix( pow2( material.roughness ), 1.0, pow2( material.anisotropy ) );
	material.anisotropyT = tbn[ 0 ] * anisotropyV.x + tbn[ 1 ] * anisotropyV.y;
	material.anisotropyB = tbn[ 1 ] * anisotropyV.x - tbn[ 0 ] * anisotropyV.y;
#endif`,z1=`uniform sampler2D dfgLUT;
struct PhysicalMaterial {
	vec3 diffuseColor;
	vec3 diffuseContribution;
	vec3 specularColor;
	vec3 specularColorBlended;
	float roughness;
	float metalness;
	float specularF90;
	float dispersion;
	vec2 dfg;
	vec3 multiScatteringCompensation;
	#ifdef USE_DIFFUSE_ROUGHNESS
		float diffuseRoughness;
	#endif
	#ifdef USE_RETROREFLECTION
		float retroreflectivity;
	#endif
	#ifdef USE_CLEARCOAT
		float clearcoat;
		float clearcoatRoughness;
		vec3 clearcoatF0;
		float clearcoatF90;
	#endif
	#ifdef USE_IRIDESCENCE
		float iridescence;
		float iridescenceIOR;
		float iridescenceThickness;
		vec3 iridescenceFresnel;
		vec3 iridescenceF0Dielectric;
		vec3 iridescenceF0Metallic;
	#endif
	#ifdef USE_SHEEN
		vec3 sheenColor;
		float sheenRoughness;
	#endif
	#ifdef IOR
		float ior;
	#endif
	#ifdef USE_TRANSMISSION
		float transmission;
		float transmissionAlpha;
		float thickness;
		float attenuationDistance;
		vec3 attenuationColor;
	#endif
	#ifdef USE_ANISOTROPY
		float anisotropy;
		float alphaT;
		vec3 anisotropyT;
		vec3 anisotropyB;
	#endif
};
vec3 clearcoatSpecularDirect = vec3( 0.0 );
vec3 clearcoatSpecularIndirect = vec3( 0.0 );
vec3 sheenSpecularDirect = vec3( 0.0 );
vec3 sheenSpecularIndirect = vec3(0.0 );
vec3 Schlick_to_F0( const in vec3 f, const in float f90, const in float dotVH ) {
    float x = clamp( 1.0 - dotVH, 0.0, 1.0 );
    float x2 = x * x;
    float x5 = clamp( x * x2 * x2, 0.0, 0.9999 );
    return ( f - vec3( f90 ) * x5 ) / ( 1.0 - x5 );
}
#ifdef USE_DIFFUSE_ROUGHNESS
	const float EON_EPSILON = 1e-7;
	float FON_DirectionalAlbedo( const in float mu, const in float roughness, const in float A ) {
		float muComp = 1.0 - mu;
		float gOverPi = muComp * ( 0.0571085289 + muComp * ( 0.491881867 + muComp * ( - 0.332181442 + muComp * 0.0714429953 ) ) );
		return A * ( 1.0 + roughness * gOverPi );
	}
	vec3 BRDF_EON( const in vec3 lightDir, const in vec3 viewDir, const in vec3 normal, const in vec3 diffuseColor, const in float roughness ) {
		vec3 rho = saturate( diffuseColor );
		if ( roughness <= EON_EPSILON ) return BRDF_Lambert( rho );
		float dotNL = saturate( dot( normal, lightDir ) );
		float dotNV = saturate( dot( normal, viewDir ) );
		float s = dot( lightDir, viewDir ) - dotNL * dotNV;
		float sOverT = ( s > 0.0 ) ? s / max( max( dotNL, dotNV ), EON_EPSILON ) : s;
		float A = 1.0 / ( 1.0 + ( 0.5 - 2.0 / ( 3.0 * PI ) ) * roughness );
		vec3 singleScatter = rho * RECIPROCAL_PI * A * ( 1.0 + roughness * sOverT );
		float averageAlbedo = A * ( 1.0 + ( 2.0 / 3.0 - 28.0 / ( 15.0 * PI ) ) * roughness );
		float albedoV = FON_DirectionalAlbedo( dotNV, roughness, A );
		float albedoL = FON_DirectionalAlbedo( dotNL, roughness, A );
		vec3 rhoMultiScatter = rho * rho * averageAlbedo / max( vec3( EON_EPSILON ), vec3( 1.0 ) - rho * ( 1.0 - averageAlbedo ) );
		vec3 multiScatter = rhoMultiScatter * RECIPROCAL_PI
			* max( EON_EPSILON, 1.0 - albedoV )
			* max( EON_EPSILON, 1.0 - albedoL )
			/ max( EON_EPSILON, 1.0 - averageAlbedo );
		return singleScatter + multiScatter;
	}
	vec3 EON_DirectionalAlbedo( const in vec3 diffuseColor, const in float roughness, const in float dotNV ) {
		vec3 rho = saturate( diffuseColor );
		if ( roughness <= EON_EPSILON ) return rho;
		float A = 1.0 / ( 1.0 + ( 0.5 - 2.0 / ( 3.0 * PI ) ) * roughness );
		float directionalAlbedo = FON_DirectionalAlbedo( dotNV, roughness, A );
		float averageAlbedo = A * ( 1.0 + ( 2.0 / 3.0 - 28.0 / ( 15.0 * PI ) ) * roughness );
		vec3 rhoMultiScatter = rho * rho * averageAlbedo / max( vec3( EON_EPSILON ), vec3( 1.0 ) - rho * ( 1.0 - averageAlbedo ) );
		return rho * directionalAlbedo + rhoMultiScatter * ( 1.0 - directionalAlbedo );
	}
#endif
float V_GGX_SmithCorrelated( const in float alpha, const in float dotNL, const in float dotNV ) {
	float a2 = pow2( alpha );
	float gv = dotNL * sqrt( a2 + ( 1.0 - a2 ) * pow2( dotNV ) );
	float gl = dotNV * sqrt( a2 + ( 1.0 - a2 ) * pow2( dotNL ) );
	return 0.5 / max( gv + gl, EPSILON );
}
float D_GGX( const in float alpha, const in float dotNH ) {
	float a2 = pow2( alpha );
	float denom = pow2( dotNH ) * ( a2 - 1.0 ) + 1.0;
	return RECIPROCAL_PI * a2 / pow2( denom );
}
#ifdef USE_ANISOTROPY
	float V_GGX_SmithCorrelated_Anisotropic( const in float alphaT, const in float alphaB, const in float dotTV, const in float dotBV, const in float dotTL, const in float dotBL, const in float dotNV, const in float dotNL ) {
		float gv = dotNL * length( vec3( alphaT * dotTV, alphaB * dotBV, dotNV ) );
		float gl = dotNV * length( vec3( alphaT * dotTL, alphaB * dotBL, dotNL ) );
		return 0.5 / max( gv + gl, EPSILON );
	}
	float D_GGX_Anisotropic( const in float alphaT, const in float alphaB, const in float dotNH, const in float dotTH, const in float dotBH ) {
		float a2 = alphaT * alphaB;
		highp vec3 v = vec3( alphaB * dotTH, alphaT * dotBH, a2 * dotNH );
		highp float v2 = dot( v, v );
		float w2 = a2 / v2;
		return RECIPROCAL_PI * a2 * pow2 ( w2 );
	}
#endif
#ifdef USE_CLEARCOAT
	vec3 BRDF_GGX_Clearcoat( const in vec3 lightDir, const in vec3 viewDir, const in vec3 normal, const in PhysicalMaterial material) {
		vec3 f0 = material.clearcoatF0;
		float f90 = material.clearcoatF90;
		float roughness = max( material.clearcoatRoughness, 0.045 );
		float alpha = pow2( roughness );
		vec3 halfDir = normalize( lightDir + viewDir );
		float dotNL = saturate( dot( normal, lightDir ) );
		float dotNV = saturate( dot( normal, viewDir ) );
		float dotNH = saturate( dot( normal, halfDir ) );
		float dotVH = saturate( dot( viewDir, halfDir ) );
		vec3 F = F_Schlick( f0, f90, dotVH );
		float V = V_GGX_SmithCorrelated( alpha, dotNL, dotNV );
		float D = D_GGX( alpha, dotNH );
		return F * ( V * D );
	}
#endif
vec3 BRDF_GGX( const in vec3 lightDir, const in vec3 viewDir, const in vec3 normal, const in PhysicalMaterial material ) {
	vec3 f0 = material.specularColorBlended;
	float f90 = material.specularF90;
	float roughness = max( material.roughness, 0.045 );
	float alpha = pow2( roughness );
	vec3 halfDir = normalize( lightDir + viewDir );
	float dotNL = saturate( dot( normal, lightDir ) );
	float dotNV = saturate( dot( normal, viewDir ) );
	float dotNH = saturate( dot( normal, halfDir ) );
	float dotVH = saturate( dot( viewDir, halfDir ) );
	vec3 F = F_Schlick( f0, f90, dotVH );
	#ifdef USE_IRIDESCENCE
		F = mix( F, material.iridescenceFresnel, material.iridescence );
	#endif
	#ifdef USE_ANISOTROPY
		float dotTL = dot( material.anisotropyT, lightDir );
		float dotTV = dot( material.anisotropyT, viewDir );
		float dotTH = dot( material.anisotropyT, halfDir );
		float dotBL = dot( material.anisotropyB, lightDir );
		float dotBV = dot( material.anisotropyB, viewDir );
		float dotBH = dot( material.anisotropyB, halfDir );
		float alphaT = max( material.alphaT, alpha );
		float V = V_GGX_SmithCorrelated_Anisotropic( alphaT, alpha, dotTV, dotBV, dotTL, dotBL, dotNV, dotNL );
		float D = D_GGX_Anisotropic( alphaT, alpha, dotNH, dotTH, dotBH );
	#else
		float V = V_GGX_SmithCorrelated( alpha, dotNL, dotNV );
		float D = D_GGX( alpha, dotNH );
	#endif
	return F * ( V * D );
}
vec2 LTC_Uv( const in vec3 N, const in vec3 V, const in float roughness ) {
	const float LUT_SIZE = 64.0;
	const float LUT_SCALE = ( LUT_SIZE - 1.0 ) / LUT_SIZE;
	const float LUT_BIAS = 0.5 / LUT_SIZE;
	float dotNV = saturate( dot( N, V ) );
	vec2 uv = vec2( roughness, sqrt( 1.0 - dotNV ) );
	uv = uv * LUT_SCALE + LUT_BIAS;
	return uv;
}
float LTC_ClippedSphereFormFactor( const in vec3 f ) {
	float l = length( f );
	return max( ( l * l + f.z ) / ( l + 1.0 ), 0.0 );
}
vec3 LTC_EdgeVectorFormFactor( const in vec3 v1, const in vec3 v2 ) {
	float x = dot( v1, v2 );
	float y = abs( x );
	float a = 0.8543985 + ( 0.4965155 + 0.0145206 * y ) * y;
	float b = 3.4175940 + ( 4.1616724 + y ) * y;
	float v = a / b;
	float theta_sintheta = ( x > 0.0 ) ? v : 0.5 * inversesqrt( max( 1.0 - x * x, 1e-7 ) ) - v;
	return cross( v1, v2 ) * theta_sintheta;
}
vec3 LTC_Evaluate( const in vec3 N, const in vec3 V, const in vec3 P, const in mat3 mInv, const in vec3 rectCoords[ 4 ] ) {
	vec3 v1 = rectCoords[ 1 ] - rectCoords[ 0 ];
	vec3 v2 = rectCoords[ 3 ] - rectCoords[ 0 ];
	vec3 lightNormal = cross( v1, v2 );
	if( dot( lightNormal, P - rectCoords[ 0 ] ) < 0.0 ) return vec3( 0.0 );
	vec3 T1, T2;
	T1 = normalize( V - N * dot( V, N ) );
	T2 = - cross( N, T1 );
	mat3 mat = mInv * transpose( mat3( T1, T2, N ) );
	vec3 coords[ 4 ];
	coords[ 0 ] = mat * ( rectCoords[ 0 ] - P );
	coords[ 1 ] = mat * ( rectCoords[ 1 ] - P );
	coords[ 2 ] = mat * ( rectCoords[ 2 ] - P );
	coords[ 3 ] = mat * ( rectCoords[ 3 ] - P );
	coords[ 0 ] = normalize( coords[ 0 ] );
	coords[ 1 ] = normalize( coords[ 1 ] );
	coords[ 2 ] = normalize( coords[ 2 ] );
	coords[ 3 ] = normalize( coords[ 3 ] );
	vec3 vectorFormFactor = vec3( 0.0 );
	vectorFormFactor += LTC_EdgeVectorFormFactor( coords[ 0 ], coords[ 1 ] );
	vectorFormFactor += LTC_EdgeVectorFormFactor( coords[ 1 ], coords[ 2 ] );
	vectorFormFactor += LTC_EdgeVectorFormFactor( coords[ 2 ], coords[ 3 ] );
	vectorFormFactor += LTC_EdgeVectorFormFactor( coords[ 3 ], coords[ 0 ] );
	float result = LTC_ClippedSphereFormFactor( vectorFormFactor );
	return vec3( result );
}
#if defined( USE_SHEEN )
float D_Charlie( float roughness, float dotNH ) {
	float alpha = pow2( roughness );
	float invAlpha = 1.0 / alpha;
	float cos2h = dotNH * dotNH;
	float sin2h = max( 1.0 - cos2h, 0.0078125 );
	return ( 2.0 + invAlpha ) * pow( sin2h, invAlpha * 0.5 ) / ( 2.0 * PI );
}
float V_Neubelt( float dotNV, float dotNL ) {
	return saturate( 1.0 / ( 4.0 * ( dotNL + dotNV - dotNL * dotNV ) ) );
}
vec3 BRDF_Sheen( const in vec3 lightDir, const in vec3 viewDir, const in vec3 normal, vec3 sheenColor, const in float sheenRoughness ) {
	vec3 halfDir = normalize( lightDir + viewDir );
	float dotNL = saturate( dot( normal, lightDir ) );
	float dotNV = saturate( dot( normal, viewDir ) );
	float dotNH = saturate( dot( normal, halfDir ) );
	float D = D_Charlie( sheenRoughness, dotNH );
	float V = V_Neubelt( dotNV, dotNL );
	return sheenColor * ( D * V );
}
#endif
float IBLSheenBRDF( const in vec3 normal, const in vec3 viewDir, const in float roughness ) {
	float dotNV = saturate( dot( normal, viewDir ) );
	float r2 = roughness * roughness;
	float rInv = 1.0 / ( roughness + 0.1 );
	float a = -1.9362 + 1.0678 * roughness + 0.4573 * r2 - 0.8469 * rInv;
	float b = -0.6014 + 0.5538 * roughness - 0.4670 * r2 - 0.1255 * rInv;
	float DG = exp( a * dotNV + b );
	return saturate( DG );
}
vec3 EnvironmentBRDF( const in vec3 normal, const in vec3 viewDir, const in vec3 specularColor, const in float specularF90, const in float roughness ) {
	float dotNV = saturate( dot( normal, viewDir ) );
	vec2 fab = texture2D( dfgLUT, vec2( roughness, dotNV ) ).rg;
	return specularColor * fab.x + specularF90 * fab.y;
}
#ifdef USE_IRIDESCENCE
void computeMultiscatteringIridescence( const in vec2 fab, const in vec3 specularColor, const in float specularF90, const in float iridescence, const in vec3 iridescenceF0, inout vec3 singleScatter, inout vec3 multiScatter ) {
#else
void computeMultiscattering( const in vec2 fab, const in vec3 specularColor, const in float specularF90, inout vec3 singleScatter, inout vec3 multiScatter ) {
#endif
	#ifdef USE_IRIDESCENCE
		vec3 Fr = mix( specularColor, iridescenceF0, iridescence );
	#else
		vec3 Fr = specularColor;
	#endif
	vec3 FssEss = Fr * fab.x + specularF90 * fab.y;
	float Ess = fab.x + fab.y;
	float Ems = 1.0 - Ess;
	vec3 Favg = Fr + ( 1.0 - Fr ) * 0.047619;	vec3 Fms = FssEss * Favg / ( 1.0 - Ems * Favg );
	singleScatter += FssEss;
	multiScatter += Fms * Ems;
}
#if NUM_RECT_AREA_LIGHTS > 0
	void RE_Direct_RectArea_Physical( const in RectAreaLight rectAreaLight, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in PhysicalMaterial material, inout ReflectedLight reflectedLight ) {
		vec3 normal = geometryNormal;
		vec3 viewDir = geometryViewDir;
		vec3 position = geometryPosition;
		vec3 lightPos = rectAreaLight.position;
		vec3 halfWidth = rectAreaLight.halfWidth;
		vec3 halfHeight = rectAreaLight.halfHeight;
		vec3 lightColor = rectAreaLight.color;
		float roughness = material.roughness;
		vec3 rectCoords[ 4 ];
		rectCoords[ 0 ] = lightPos + halfWidth - halfHeight;		rectCoords[ 1 ] = lightPos - halfWidth - halfHeight;
		rectCoords[ 2 ] = lightPos - halfWidth + halfHeight;
		rectCoords[ 3 ] = lightPos + halfWidth + halfHeight;
		vec2 uv = LTC_Uv( normal, viewDir, roughness );
		vec4 t1 = texture2D( ltc_1, uv );
		vec4 t2 = texture2D( ltc_2, uv );
		mat3 mInv = mat3(
			vec3( t1.x, 0, t1.y ),
			vec3(    0, 1,    0 ),
			vec3( t1.z, 0, t1.w )
		);
		vec3 fresnel = ( material.specularColorBlended * t2.x + ( material.specularF90 - material.specularColorBlended ) * t2.y );
		reflectedLight.directSpecular += lightColor * fresnel * LTC_Evaluate( normal, viewDir, position, mInv, rectCoords );
		reflectedLight.directDiffuse += lightColor * material.diffuseContribution * LTC_Evaluate( normal, viewDir, position, mat3( 1.0 ), rectCoords );
		#ifdef USE_CLEARCOAT
			vec3 Ncc = geometryClearcoatNormal;
			vec2 uvClearcoat = LTC_Uv( Ncc, viewDir, material.clearcoatRoughness );
			vec4 t1Clearcoat = texture2D( ltc_1, uvClearcoat );
			vec4 t2Clearcoat = texture2D( ltc_2, uvClearcoat );
			mat3 mInvClearcoat = mat3(
				vec3( t1Clearcoat.x, 0, t1Clearcoat.y ),
				vec3(             0, 1,             0 ),
				vec3( t1Clearcoat.z, 0, t1Clearcoat.w )
			);
			vec3 fresnelClearcoat = material.clearcoatF0 * t2Clearcoat.x + ( material.clearcoatF90 - material.clearcoatF0 ) * t2Clearcoat.y;
			clearcoatSpecularDirect += lightColor * fresnelClearcoat * LTC_Evaluate( Ncc, viewDir, position, mInvClearcoat, rectCoords );
		#endif
	}
#endif
void RE_Direct_Physical( const in IncidentLight directLight, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in PhysicalMaterial material, inout ReflectedLight reflectedLight ) {
	float dotNL = saturate( dot( geometryNormal, directLight.direction ) );
	vec3 irradiance = dotNL * directLight.color;
	#ifdef USE_CLEARCOAT
		float dotNLcc = saturate( dot( geometryClearcoatNormal, directLight.direction ) );
		vec3 ccIrradiance = dotNLcc * directLight.color;
		clearcoatSpecularDirect += ccIrradiance * BRDF_GGX_Clearcoat( directLight.direction, geometryViewDir, geometryClearcoatNormal, material );
	#endif
	#ifdef USE_SHEEN
 
 		sheenSpecularDirect += irradiance * BRDF_Sheen( directLight.direction, geometryViewDir, geometryNormal, material.sheenColor, material.sheenRoughness );
 
 		float sheenAlbedoV = IBLSheenBRDF( geometryNormal, geometryViewDir, material.sheenRoughness );
 		float sheenAlbedoL = IBLSheenBRDF( geometryNormal, directLight.direction, material.sheenRoughness );
 
 		float sheenEnergyComp = 1.0 - max3( material.sheenColor ) * max( sheenAlbedoV, sheenAlbedoL );
 
 		irradiance *= sheenEnergyComp;
 
 	#endif
	vec3 specularBRDF = BRDF_GGX( directLight.direction, geometryViewDir, geometryNormal, material );
	#ifdef USE_RETROREFLECTION
		vec3 retroViewDir = reflect( - geometryViewDir, geometryNormal );
		vec3 retroSpecularBRDF = BRDF_GGX( directLight.direction, retroViewDir, geometryNormal, material );
		specularBRDF = mix( specularBRDF, retroSpecularBRDF, saturate( material.retroreflectivity ) );
	#endif
	reflectedLight.directSpecular += irradiance * specularBRDF * material.multiScatteringCompensation;
	vec3 halfDir = normalize( directLight.direction + geometryViewDir );
	float dotVH = saturate( dot( geometryViewDir, halfDir ) );
	vec3 F = F_Schlick( material.specularColor, material.specularF90, dotVH );
	#ifdef USE_RETROREFLECTION
		vec3 retroHalfDir = normalize( directLight.direction + retroViewDir );
		float dotRetroVH = saturate( dot( retroViewDir, retroHalfDir ) );
		vec3 retroF = F_Schlick( material.specularColor, material.specularF90, dotRetroVH );
		F = mix( F, retroF, saturate( material.retroreflectivity ) );
	#endif
	#ifdef USE_DIFFUSE_ROUGHNESS
		vec3 diffuseBRDF = BRDF_EON( directLight.direction, geometryViewDir, geometryNormal, material.diffuseColor, material.diffuseRoughness ) * ( 1.0 - material.metalness );
	#else
		vec3 diffuseBRDF = BRDF_Lambert( material.diffuseContribution );
	#endif
	reflectedLight.directDiffuse += irradiance * diffuseBRDF * ( 1.0 - F );
}
void RE_IndirectDiffuse_Physical( const in vec3 irradiance, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in PhysicalMaterial material, inout ReflectedLight reflectedLight ) {
	vec3 singleScattering = vec3( 0.0 );
	vec3 multiScattering = vec3( 0.0 );
	#ifdef USE_IRIDESCENCE
		computeMultiscatteringIridescence( material.dfg, material.specularColor, material.specularF90, material.iridescence, material.iridescenceF0Dielectric, singleScattering, multiScattering );
	#else
		computeMultiscattering( material.dfg, material.specularColor, material.specularF90, singleScattering, multiScattering );
	#endif
	#ifdef USE_DIFFUSE_ROUGHNESS
		float dotNV = saturate( dot( geometryNormal, geometryViewDir ) );
		vec3 diffuseAlbedo = EON_DirectionalAlbedo( material.diffuseColor, material.diffuseRoughness, dotNV ) * ( 1.0 - material.metalness );
		vec3 diffuse = irradiance * RECIPROCAL_PI * diffuseAlbedo * ( 1.0 - singleScattering - multiScattering );
	#else
		vec3 diffuse = irradiance * BRDF_Lambert( material.diffuseContribution ) * ( 1.0 - singleScattering - multiScattering );
	#endif
	#ifdef USE_SHEEN
		float sheenAlbedo = IBLSheenBRDF( geometryNormal, geometryViewDir, material.sheenRoughness );
		sheenSpecularIndirect += irradiance * material.sheenColor * sheenAlbedo * RECIPROCAL_PI;
		float sheenEnergyComp = 1.0 - max3( material.sheenColor ) * sheenAlbedo;
		diffuse *= sheenEnergyComp;
	#endif
	reflectedLight.indirectDiffuse += diffuse;
}
void RE_IndirectSpecular_Physical( const in vec3 radiance, const in vec3 irradiance, const in vec3 clearcoatRadiance, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in PhysicalMaterial material, inout ReflectedLight reflectedLight) {
	#ifdef USE_CLEARCOAT
		clearcoatSpecularIndirect += clearcoatRadiance * EnvironmentBRDF( geometryClearcoatNormal, geometryViewDir, material.clearcoatF0, material.clearcoatF90, material.clearcoatRoughness );
	#endif
	#ifdef USE_SHEEN
		sheenSpecularIndirect += irradiance * material.sheenColor * IBLSheenBRDF( geometryNormal, geometryViewDir, material.sheenRoughness ) * RECIPROCAL_PI;
 	#endif
	vec3 singleScatteringDielectric = vec3( 0.0 );
	vec3 multiScatteringDielectric = vec3( 0.0 );
	vec3 singleScatteringMetallic = vec3( 0.0 );
	vec3 multiScatteringMetallic = vec3( 0.0 );
	#ifdef USE_IRIDESCENCE
		computeMultiscatteringIridescence( material.dfg, material.specularColor, material.specularF90, material.iridescence, material.iridescenceF0Dielectric, singleScatteringDielectric, multiScatteringDielectric );
		computeMultiscatteringIridescence( material.dfg, material.diffuseColor, material.specularF90, material.iridescence, material.iridescenceF0Metallic, singleScatteringMetallic, multiScatteringMetallic );
	#else
		computeMultiscattering( material.dfg, material.specularColor, material.specularF90, singleScatteringDielectric, multiScatteringDielectric );
		computeMultiscattering( material.dfg, material.diffuseColor, material.specularF90, singleScatteringMetallic, multiScatteringMetallic );
	#endif
	vec3 singleScattering = mix( singleScatteringDielectric, singleScatteringMetallic, material.metalness );
	vec3 multiScattering = mix( multiScatteringDielectric, multiScatteringMetallic, material.metalness );
	vec3 totalScatteringDielectric = singleScatteringDielectric + multiScatteringDielectric;
	#ifdef USE_DIFFUSE_ROUGHNESS
		float dotNV = saturate( dot( geometryNormal, geometryViewDir ) );
		vec3 diffuse = EON_DirectionalAlbedo( material.diffuseColor, material.diffuseRoughness, dotNV ) * ( 1.0 - material.metalness ) * ( 1.0 - totalScatteringDielectric );
	#else
		vec3 diffuse = material.diffuseContribution * ( 1.0 - totalScatteringDielectric );
	#endif
	vec3 cosineWeightedIrradiance = irradiance * RECIPROCAL_PI;
	vec3 indirectSpecular = radiance * singleScattering;
	indirectSpecular += multiScattering * cosineWeightedIrradiance;
	vec3 indirectDiffuse = diffuse * cosineWeightedIrradiance;
	#ifdef USE_SHEEN
		float sheenAlbedo = IBLSheenBRDF( geometryNormal, geometryViewDir, material.sheenRoughness );
		float sheenEnergyComp = 1.0 - max3( material.sheenColor ) * sheenAlbedo;
		indirectSpecular *= sheenEnergyComp;
		indirectDiffuse *= sheenEnergyComp;
	#endif
	reflectedLight.indirectSpecular += indirectSpecular;
	reflectedLight.indirectDiffuse += indirectDiffuse;
}
#define RE_Direct				RE_Direct_Physical
#define RE_Direct_RectArea		RE_Direct_RectArea_Physical
#define RE_IndirectDiffuse		RE_IndirectDiffuse_Physical
#define RE_IndirectSpecular		RE_IndirectSpecular_Physical
float computeSpecularOcclusion( const in float dotNV, const in float ambientOcclusion, const in float roughness ) {
	return saturate( pow( dotNV + ambientOcclusion, exp2( - 16.0 * roughness - 1.0 ) ) - 1.0 + ambientOcclusion );
}`,V1=`
vec3 geometryPosition = - vViewPosition;
vec3 geometryNormal = normal;
vec3 geometryViewDir = ( isOrthographic ) ? vec3( 0, 0, 1 ) : normalize( vViewPosition );
vec3 geometryClearcoatNormal = vec3( 0.0 );
#ifdef USE_CLEARCOAT
	geometryClearcoatNormal = clearcoatNormal;
#endif
#ifdef USE_IRIDESCENCE
	float dotNVi = saturate( dot( normal, geometryViewDir ) );
	if ( material.iridescenceThickness == 0.0 ) {
		material.iridescence = 0.0;
	} else {
		material.iridescence = saturate( material.iridescence );
	}
	if ( material.iridescence > 0.0 ) {
		vec3 iridescenceFresnelDielectric = evalIridescence( 1.0, material.iridescenceIOR, dotNVi, material.iridescenceThickness, material.specularColor );
		vec3 iridescenceFresnelMetallic = evalIridescence( 1.0, material.iridescenceIOR, dotNVi, material.iridescenceThickness, material.diffuseColor );
		material.iridescenceFresnel = mix( iridescenceFresnelDielectric, iridescenceFresnelMetallic, material.metalness );
		material.iridescenceF0Dielectric = Schlick_to_F0( iridescenceFresnelDielectric, 1.0, dotNVi );
		material.iridescenceF0Metallic = Schlick_to_F0( iridescenceFresnelMetallic, 1.0, dotNVi );
	}
#endif
#ifdef STANDARD
	float dotNVms = saturate( dot( geometryNormal, geometryViewDir ) );
	material.dfg = texture2D( dfgLUT, vec2( material.roughness, dotNVms ) ).rg;
	#if ( NUM_SUN_LIGHTS > 0 || NUM_DIR_LIGHTS > 0 || NUM_POINT_LIGHTS > 0 || NUM_SPOT_LIGHTS > 0 )
		float EssMs = material.dfg.x + material.dfg.y;
		material.multiScatteringCompensation = 1.0 + material.specularColorBlended * ( 1.0 / EssMs - 1.0 );
	#endif
#endif
IncidentLight directLight;
#if ( NUM_POINT_LIGHTS > 0 ) && defined( RE_Direct )
	PointLight pointLight;
	#if defined( USE_SHADOWMAP ) && NUM_POINT_LIGHT_SHADOWS > 0
	PointLightShadow pointLightShadow;
	#endif
	#pragma unroll_loop_start
	for ( int i = 0; i < NUM_POINT_LIGHTS; i ++ ) {
		pointLight = pointLights[ i ];
		getPointLightInfo( pointLight, geometryPosition, directLight );
		#if defined( USE_SHADOWMAP ) && ( UNROLLED_LOOP_INDEX < NUM_POINT_LIGHT_SHADOWS ) && ( defined( SHADOWMAP_TYPE_PCF ) || defined( SHADOWMAP_TYPE_BASIC ) )
		pointLightShadow = pointLightShadows[ i ];
		directLight.color *= ( directLight.visible && receiveShadow ) ? getPointShadow( pointShadowMap[ i ], pointLightShadow.shadowMapSize, pointLightShadow.shadowIntensity, pointLightShadow.shadowBias, pointLightShadow.shadowRadius, vPointShadowCoord[ i ], pointLightShadow.shadowCameraNear, pointLightShadow.shadowCameraFar ) : 1.0;
		#endif
		RE_Direct( directLight, geometryPosition, geometryNormal, geometryViewDir, geometryClearcoatNormal, material, reflectedLight );
	}
	#pragma unroll_loop_end
#endif
#if ( NUM_SPOT_LIGHTS > 0 ) && defined( RE_Direct )
	SpotLight spotLight;
	vec4 spotColor;
	vec3 spotLightCoord;
	bool inSpotLightMap;
	#if defined( USE_SHADOWMAP ) && NUM_SPOT_LIGHT_SHADOWS > 0
	SpotLightShadow spotLightShadow;
	#endif
	#pragma unroll_loop_start
	for ( int i = 0; i < NUM_SPOT_LIGHTS; i ++ ) {
		spotLight = spotLights[ i ];
		getSpotLightInfo( spotLight, geometryPosition, directLight );
		#if ( UNROLLED_LOOP_INDEX < NUM_SPOT_LIGHT_SHADOWS_WITH_MAPS )
		#define SPOT_LIGHT_MAP_INDEX UNROLLED_LOOP_INDEX
		#elif ( UNROLLED_LOOP_INDEX < NUM_SPOT_LIGHT_SHADOWS )
		#define SPOT_LIGHT_MAP_INDEX NUM_SPOT_LIGHT_MAPS
		#else
		#define SPOT_LIGHT_MAP_INDEX ( UNROLLED_LOOP_INDEX - NUM_SPOT_LIGHT_SHADOWS + NUM_SPOT_LIGHT_SHADOWS_WITH_MAPS )
		#endif
		#if ( SPOT_LIGHT_MAP_INDEX < NUM_SPOT_LIGHT_MAPS )
			spotLightCoord = vSpotLightCoord[ i ].xyz / vSpotLightCoord[ i ].w;
			inSpotLightMap = all( lessThan( abs( spotLightCoord * 2. - 1. ), vec3( 1.0 ) ) );
			spotColor = texture2D( spotLightMap[ SPOT_LIGHT_MAP_INDEX ], spotLightCoord.xy );
			directLight.color = inSpotLightMap ? directLight.color * spotColor.rgb : directLight.color;
		#endif
		#undef SPOT_LIGHT_MAP_INDEX
		#if defined( USE_SHADOWMAP ) && ( UNROLLED_LOOP_INDEX < NUM_SPOT_LIGHT_SHADOWS )
		spotLightShadow = spotLightShadows[ i ];
		directLight.color *= ( directLight.visible && receiveShadow ) ? getShadow( spotShadowMap[ i ], spotLightShadow.shadowMapSize, spotLightShadow.shadowIntensity, spotLightShadow.shadowBias, spotLightShadow.shadowRadius, vSpotLightCoord[ i ] ) : 1.0;
		#endif
		RE_Direct( directLight, geometryPosition, geometryNormal, geometryViewDir, geometryClearcoatNormal, material, reflectedLight );
	}
	#pragma unroll_loop_end
#endif
#if ( NUM_SUN_LIGHTS > 0 ) && defined( RE_Direct )
	SunLight sunLight;
	#if defined( USE_SHADOWMAP ) && NUM_SUN_LIGHT_SHADOWS > 0
	SunLightShadow sunLightShadow;
	#endif
	#pragma unroll_loop_start
	for ( int i = 0; i < NUM_SUN_LIGHTS; i ++ ) {
		sunLight = sunLights[ i ];
		getSunLightInfo( sunLight, directLight );
		#if defined( USE_SHADOWMAP ) && ( UNROLLED_LOOP_INDEX < NUM_SUN_LIGHT_SHADOWS )
		sunLightShadow = sunLightShadows[ i ];
		directLight.color *= ( directLight.visible && receiveShadow ) ? getSunShadow( sunShadowMap[ i ], sunLightShadow, UNROLLED_LOOP_INDEX ) : 1.0;
		#endif
		RE_Direct( directLight, geometryPosition, geometryNormal, geometryViewDir, geometryClearcoatNormal, material, reflectedLight );
	}
	#pragma unroll_loop_end
#endif
#if ( NUM_DIR_LIGHTS > 0 ) && defined( RE_Direct )
	DirectionalLight directionalLight;
	#if defined( USE_SHADOWMAP ) && NUM_DIR_LIGHT_SHADOWS > 0
	DirectionalLightShadow directionalLightShadow;
	#endif
	#pragma unroll_loop_start
	for ( int i = 0; i < NUM_DIR_LIGHTS; i ++ ) {
		directionalLight = directionalLights[ i ];
		getDirectionalLightInfo( directionalLight, directLight );
		#if defined( USE_SHADOWMAP ) && ( UNROLLED_LOOP_INDEX < NUM_DIR_LIGHT_SHADOWS )
		directionalLightShadow = directionalLightShadows[ i ];
		directLight.color *= ( directLight.visible && receiveShadow ) ? getShadow( directionalShadowMap[ i ], directionalLightShadow.shadowMapSize, directionalLightShadow.shadowIntensity, directionalLightShadow.shadowBias, directionalLightShadow.shadowRadius, vDirectionalShadowCoord[ i ] ) : 1.0;
		#endif
		RE_Direct( directLight, geometryPosition, geometryNormal, geometryViewDir, geometryClearcoatNormal, material, reflectedLight );
	}
	#pragma unroll_loop_end
#endif
#if ( NUM_RECT_AREA_LIGHTS > 0 ) && defined( RE_Direct_RectArea )
	RectAreaLight rectAreaLight;
	#pragma unroll_loop_start
	for ( int i = 0; i < NUM_RECT_AREA_LIGHTS; i ++ ) {
		rectAreaLight = rectAreaLights[ i ];
		RE_Direct_RectArea( rectAreaLight, geometryPosition, geometryNormal, geometryViewDir, geometryClearcoatNormal, material, reflectedLight );
	}
	#pragma unroll_loop_end
#endif
#if defined( RE_IndirectDiffuse )
	vec3 iblIrradiance = vec3( 0.0 );
	vec3 irradiance = getAmbientLightIrradiance( ambientLightColor );
	#if defined( USE_LIGHT_PROBES )
		irradiance += getLightProbeIrradiance( lightProbe, geometryNormal );
	#endif
	#if ( NUM_HEMI_LIGHTS > 0 )
		#pragma unroll_loop_start
		for ( int i = 0; i < NUM_HEMI_LIGHTS; i ++ ) {
			irradiance += getHemisphereLightIrradiance( hemisphereLights[ i ], geometryNormal );
		}
		#pragma unroll_loop_end
	#endif
	#if NUM_LIGHT_PROBE_GRIDS > 0
		vec3 probeWorldPos = ( ( vec4( geometryPosition, 1.0 ) - viewMatrix[ 3 ] ) * viewMatrix ).xyz;
		vec3 probeWorldNormal = transformNormalByInverseViewMatrix( geometryNormal, viewMatrix );
		int probeGrid = - 1;
		#pragma unroll_loop_start
		for ( int i = 0; i < NUM_LIGHT_PROBE_GRIDS; i ++ ) {
			if ( isInsideLightProbeGrid( probeWorldPos, probeWorldNormal, probesMin[ i ], probesMax[ i ], probesResolution[ i ] ) ) probeGrid = UNROLLED_LOOP_INDEX;
		}
		#pragma unroll_loop_end
		#pragma unroll_loop_start
		for ( int i = 0; i < NUM_LIGHT_PROBE_GRIDS; i ++ ) {
			if ( probeGrid == UNROLLED_LOOP_INDEX ) irradiance += getLightProbeGridIrradiance( probesSH[ i ], probesMin[ i ], probesMax[ i ], probesResolution[ i ], probeWorldPos, probeWorldNormal );
		}
		#pragma unroll_loop_end
	#endif
#endif
#if defined( RE_IndirectSpecular )
	vec3 radiance = vec3( 0.0 );
	vec3 clearcoatRadiance = vec3( 0.0 );
#endif`,H1=`#if defined( RE_IndirectDiffuse )
	#ifdef USE_LIGHTMAP
		vec4 lightMapTexel = texture2D( lightMap, vLightMapUv );
		vec3 lightMapIrradiance = lightMapTexel.rgb * lightMapIntensity;
		irradiance += lightMapIrradiance;
	#endif
	#if defined( USE_ENVMAP ) && defined( ENVMAP_TYPE_PMREM )
		#if defined( STANDARD ) || defined( LAMBERT ) || defined( PHONG )
			iblIrradiance += getIBLIrradiance( geometryNormal );
		#endif
	#endif
#endif
#if defined( USE_ENVMAP ) && defined( RE_IndirectSpecular )
	#ifdef USE_ANISOTROPY
		vec3 iblRadiance = getIBLAnisotropyRadiance( geometryViewDir, geometryNormal, material.roughness, material.anisotropyB, material.anisotropy );
	#else
		vec3 iblRadiance = getIBLRadiance( geometryViewDir, geometryNormal, material.roughness );
	#endif
	#ifdef USE_RETROREFLECTION
		#ifdef USE_ANISOTROPY
			vec3 retroIBLRadiance = getIBLAnisotropyRetroRadiance( geometryViewDir, geometryNormal, material.roughness, material.anisotropyB, material.anisotropy );
		#else
			vec3 retroIBLRadiance = getIBLRetroRadiance( geometryViewDir, geometryNormal, material.roughness );
		#endif
		iblRadiance = mix( iblRadiance, retroIBLRadiance, saturate( material.retroreflectivity ) );
	#endif
	radiance += iblRadiance;
	#ifdef USE_CLEARCOAT
		clearcoatRadiance += getIBLRadiance( geometryViewDir, geometryClearcoatNormal, material.clearcoatRoughness );
	#endif
#endif`,$1=`#if defined( RE_IndirectDiffuse )
	#if defined( LAMBERT ) || defined( PHONG )
		irradiance += iblIrradiance;
	#endif
	RE_IndirectDiffuse( irradiance, geometryPosition, geometryNormal, geometryViewDir, geometryClearcoatNormal, material, reflectedLight );
#endif
#if defined( RE_IndirectSpecular )
	RE_IndirectSpecular( radiance, iblIrradiance, clearcoatRadiance, geometryPosition, geometryNormal, geometryViewDir, geometryClearcoatNormal, material, reflectedLight );
#endif`,G1=`#if NUM_LIGHT_PROBE_GRIDS > 0
uniform highp sampler3D probesSH[ NUM_LIGHT_PROBE_GRIDS ];
uniform vec3 probesMin[ NUM_LIGHT_PROBE_GRIDS ];
uniform vec3 probesMax[ NUM_LIGHT_PROBE_GRIDS ];
uniform vec3 probesResolution[ NUM_LIGHT_PROBE_GRIDS ];
bool isInsideLightProbeGrid( vec3 worldPos, vec3 worldNormal, vec3 probesMin, vec3 probesMax, vec3 probesResolution ) {
	vec3 spacing = ( probesMax - probesMin ) / probesResolution;
	vec3 samplePos = worldPos + worldNormal * spacing * 0.5;
	vec3 margin = spacing * 0.01;
	return all( greaterThanEqual( samplePos, probesMin - margin ) ) && all( lessThanEqual( samplePos, probesMax + margin ) );
}
vec3 getLightProbeGridIrradiance( highp sampler3D probesSH, vec3 probesMin, vec3 probesMax, vec3 probesResolution, vec3 worldPos, vec3 worldNormal ) {
	vec3 res = probesResolution;
	vec3 gridRange = probesMax - probesMin;
	vec3 probeSpacing = gridRange / res;
	vec3 samplePos = worldPos + worldNormal * probeSpacing * 0.5;
	vec3 uvw = clamp( ( samplePos - probesMin ) / gridRange, 0.5 / res, 1.0 - 0.5 / res );
	float nz          = res.z;
	float paddedSlices = nz + 2.0;
	float atlasDepth  = 7.0 * paddedSlices;
	float uvZBase     = uvw.z * nz + 1.0;
	vec4 s0 = texture( probesSH, vec3( uvw.xy, ( uvZBase                       ) / atlasDepth ) );
	vec4 s1 = texture( probesSH, vec3( uvw.xy, ( uvZBase +       paddedSlices   ) / atlasDepth ) );
	vec4 s2 = texture( probesSH, vec3( uvw.xy, ( uvZBase + 2.0 * paddedSlices   ) / atlasDepth ) );
	vec4 s3 = texture( probesSH, vec3( uvw.xy, ( uvZBase + 3.0 * paddedSlices   ) / atlasDepth ) );
	vec4 s4 = texture( probesSH, vec3( uvw.xy, ( uvZBase + 4.0 * paddedSlices   ) / atlasDepth ) );
	vec4 s5 = texture( probesSH, vec3( uvw.xy, ( uvZBase + 5.0 * paddedSlices   ) / atlasDepth ) );
	vec4 s6 = texture( probesSH, vec3( uvw.xy, ( uvZBase + 6.0 * paddedSlices   ) / atlasDepth ) );
	vec3 c0 = s0.xyz;
	vec3 c1 = vec3( s0.w, s1.xy );
	vec3 c2 = vec3( s1.zw, s2.x );
	vec3 c3 = s2.yzw;
	vec3 c4 = s3.xyz;
	vec3 c5 = vec3( s3.w, s4.xy );
	vec3 c6 = vec3( s4.zw, s5.x );
	vec3 c7 = s5.yzw;
	vec3 c8 = s6.xyz;
	float x = worldNormal.x, y = worldNormal.y, z = worldNormal.z;
	vec3 result = c0 * 0.886227;
	result += c1 * 2.0 * 0.511664 * y;
	result += c2 * 2.0 * 0.511664 * z;
	result += c3 * 2.0 * 0.511664 * x;
	result += c4 * 2.0 * 0.429043 * x * y;
	result += c5 * 2.0 * 0.429043 * y * z;
	result += c6 * ( 0.743125 * z * z - 0.247708 );
	result += c7 * 2.0 * 0.429043 * x * z;
	result += c8 * 0.429043 * ( x * x - y * y );
	return max( result, vec3( 0.0 ) );
}
#endif`,W1=`#if defined( USE_LOGARITHMIC_DEPTH_BUFFER )
	gl_FragDepth = vIsPerspective == 0.0 ? gl_FragCoord.z : log2( vFragDepth ) * logDepthBufFC * 0.5;
#endif`,X1=`#if defined( USE_LOGARITHMIC_DEPTH_BUFFER )
	uniform float logDepthBufFC;
	varying float vFragDepth;
	varying float vIsPerspective;
#endif`,q1=`#ifdef USE_LOGARITHMIC_DEPTH_BUFFER
	varying float vFragDepth;
	varying float vIsPerspective;
#endif`,Y1=`#ifdef USE_LOGARITHMIC_DEPTH_BUFFER
	vFragDepth = 1.0 + gl_Position.w;
	vIsPerspective = float( isPerspectiveMatrix( projectionMatrix ) );
#endif`,j1=`#ifdef USE_MAP
	vec4 sampledDiffuseColor = texture2D( map, vMapUv );
	#ifdef DECODE_VIDEO_TEXTURE
		sampledDiffuseColor = sRGBTransferEOTF( sampledDiffuseColor );
	#endif
	diffuseColor *= sampledDiffuseColor;
#endif`,Z1=`#ifdef USE_MAP
	uniform sampler2D map;
#endif`,J1=`#if defined( USE_MAP ) || defined( USE_ALPHAMAP )
	#if defined( USE_POINTS_UV )
		vec2 uv = vUv;
	#else
		vec2 uv = ( uvTransform * vec3( gl_PointCoord.x, 1.0 - gl_PointCoord.y, 1 ) ).xy;
	#endif
#endif
#ifdef USE_MAP
	diffuseColor *= texture2D( map, uv );
#endif
#ifdef USE_ALPHAMAP
	diffuseColor.a *= texture2D( alphaMap, uv ).g;
#endif`,K1=`#if defined( USE_POINTS_UV )
	varying vec2 vUv;
#else
	#if defined( USE_MAP ) || defined( USE_ALPHAMAP )
		uniform mat3 uvTransform;
	#endif
#endif
#ifdef USE_MAP
	uniform sampler2D map;
#endif
#ifdef USE_ALPHAMAP
	uniform sampler2D alphaMap;
#endif`,Q1=`float metalnessFactor = metalness;
#ifdef USE_METALNESSMAP
	vec4 texelMetalness = texture2D( metalnessMap, vMetalnessMapUv );
	metalnessFactor *= texelMetalness.b;
#endif`,eE=`#ifdef USE_METALNESSMAP
	uniform sampler2D metalnessMap;
#endif`,tE=`#ifdef USE_INSTANCING_MORPH
	float morphTargetInfluences[ MORPHTARGETS_COUNT ];
	float morphTargetBaseInfluence = texelFetch( morphTexture, ivec2( 0, gl_InstanceID ), 0 ).r;
	for ( int i = 0; i < MORPHTARGETS_COUNT; i ++ ) {
		morphTargetInfluences[i] =  texelFetch( morphTexture, ivec2( i + 1, gl_InstanceID ), 0 ).r;
	}
#endif`,nE=`#if defined( USE_MORPHCOLORS )
	#if defined( USE_COLOR_ALPHA )
		vColor *= morphTargetBaseInfluence;
	#elif defined( USE_COLOR )
		vColor.rgb *= morphTargetBaseInfluence;
	#endif
	for ( int i = 0; i < MORPHTARGETS_COUNT; i ++ ) {
		#if defined( USE_COLOR_ALPHA )
			if ( morphTargetInfluences[ i ] != 0.0 ) vColor += getMorph( gl_VertexID, i, 2 ) * morphTargetInfluences[ i ];
		#elif defined( USE_COLOR )
			if ( morphTargetInfluences[ i ] != 0.0 ) vColor.rgb += getMorph( gl_VertexID, i, 2 ).rgb * morphTargetInfluences[ i ];
		#endif
	}
#endif`,iE=`#ifdef USE_MORPHNORMALS
	objectNormal *= morphTargetBaseInfluence;
	for ( int i = 0; i < MORPHTARGETS_COUNT; i ++ ) {
		if ( morphTargetInfluences[ i ] != 0.0 ) objectNormal += getMorph( gl_VertexID, i, 1 ).xyz * morphTargetInfluences[ i ];
	}
#endif`,sE=`#ifdef USE_MORPHTARGETS
	#ifndef USE_INSTANCING_MORPH
		uniform float morphTargetBaseInfluence;
		uniform float morphTargetInfluences[ MORPHTARGETS_COUNT ];
	#endif
	uniform sampler2DArray morphTargetsTexture;
	uniform ivec2 morphTargetsTextureSize;
	vec4 getMorph( const in int vertexIndex, const in int morphTargetIndex, const in int offset ) {
		int texelIndex = vertexIndex * MORPHTARGETS_TEXTURE_STRIDE + offset;
		int y = texelIndex / morphTargetsTextureSize.x;
		int x = texelIndex - y * morphTargetsTextureSize.x;
		ivec3 morphUV = ivec3( x, y, morphTargetIndex );
		return texelFetch( morphTargetsTexture, morphUV, 0 );
	}
#endif`,rE=`#ifdef USE_MORPHTARGETS
	transformed *= morphTargetBaseInfluence;
	for ( int i = 0; i < MORPHTARGETS_COUNT; i ++ ) {
		if ( morphTargetInfluences[ i ] != 0.0 ) transformed += getMorph( gl_VertexID, i, 0 ).xyz * morphTargetInfluences[ i ];
	}
#endif`,oE=`float faceDirection = gl_FrontFacing ? 1.0 : - 1.0;
#ifdef FLAT_SHADED
	vec3 fdx = dFdx( vViewPosition );
	vec3 fdy = dFdy( vViewPosition );
	vec3 normal = normalize( cross( fdx, fdy ) );
#else
	vec3 normal = normalize( vNormal );
	#ifdef DOUBLE_SIDED
		normal *= faceDirection;
	#endif
#endif
#if defined( USE_NORMALMAP_TANGENTSPACE ) || defined( USE_CLEARCOAT_NORMALMAP ) || defined( USE_ANISOTROPY )
	#ifdef USE_TANGENT
		mat3 tbn = mat3( normalize( vTangent ), normalize( vBitangent ), normal );
	#else
		mat3 tbn = getTangentFrame( - vViewPosition, normal,
		#if defined( USE_NORMALMAP )
			vNormalMapUv
		#elif defined( USE_CLEARCOAT_NORMALMAP )
			vClearcoatNormalMapUv
		#else
			vUv
		#endif
		);
	#endif
	#ifdef DOUBLE_SIDED
		tbn[0] *= faceDirection;
		tbn[1] *= faceDirection;
	#endif
#endif
#ifdef USE_CLEARCOAT_NORMALMAP
	#ifdef USE_TANGENT
		mat3 tbn2 = mat3( normalize( vTangent ), normalize( vBitangent ), normal );
	#else
		mat3 tbn2 = getTangentFrame( - vViewPosition, normal, vClearcoatNormalMapUv );
	#endif
	#ifdef DOUBLE_SIDED
		tbn2[0] *= faceDirection;
		tbn2[1] *= faceDirection;
	#endif
#endif
vec3 nonPerturbedNormal = normal;`,aE=`#ifdef USE_NORMALMAP_OBJECTSPACE
	normal = texture2D( normalMap, vNormalMapUv ).xyz * 2.0 - 1.0;
	#ifdef FLIP_SIDED
		normal = - normal;
	#endif
	#ifdef DOUBLE_SIDED
		normal = normal * faceDirection;
	#endif
	normal = normalize( normalMatrix * normal );
#elif defined( USE_NORMALMAP_TANGENTSPACE )
	vec3 mapN = texture2D( normalMap, vNormalMapUv ).xyz * 2.0 - 1.0;
	#if defined( USE_PACKED_NORMALMAP )
		mapN = vec3( mapN.xy, sqrt( saturate( 1.0 - dot( mapN.xy, mapN.xy ) ) ) );
	#endif
	mapN.xy *= normalScale;
	normal = normalize( tbn * mapN );
#elif defined( USE_BUMPMAP )
	normal = perturbNormalArb( - vViewPosition, normal, dHdxy_fwd(), faceDirection );
#endif`,lE=`#ifndef FLAT_SHADED
	varying vec3 vNormal;
	#ifdef USE_TANGENT
		varying vec3 vTangent;
		varying vec3 vBitangent;
	#endif
#endif`,cE=`#ifndef FLAT_SHADED
	varying vec3 vNormal;
	#ifdef USE_TANGENT
		varying vec3 vTangent;
		varying vec3 vBitangent;
	#endif
#endif`,uE=`#ifndef FLAT_SHADED
	vNormal = normalize( transformedNormal );
	#ifdef USE_TANGENT
		vTangent = normalize( transformedTangent );
		vBitangent = normalize( cross( vNormal, vTangent ) * tangent.w );
		#ifdef FLIP_SIDED
			vBitangent = - vBitangent;
		#endif
	#endif
#endif`,hE=`#ifdef USE_NORMALMAP
	uniform sampler2D normalMap;
	uniform vec2 normalScale;
#endif
#ifdef USE_NORMALMAP_OBJECTSPACE
	uniform mat3 normalMatrix;
#endif
#if ! defined ( USE_TANGENT ) && ( defined ( USE_NORMALMAP_TANGENTSPACE ) || defined ( USE_CLEARCOAT_NORMALMAP ) || defined( USE_ANISOTROPY ) )
	mat3 getTangentFrame( vec3 eye_pos, vec3 surf_norm, vec2 uv ) {
		vec3 q0 = dFdx( eye_pos.xyz );
		vec3 q1 = dFdy( eye_pos.xyz );
		vec2 st0 = dFdx( uv.st );
		vec2 st1 = dFdy( uv.st );
		vec3 N = surf_norm;
		vec3 q1perp = cross( q1, N );
		vec3 q0perp = cross( N, q0 );
		vec3 T = q1perp * st0.x + q0perp * st1.x;
		vec3 B = q1perp * st0.y + q0perp * st1.y;
		float det = max( dot( T, T ), dot( B, B ) );
		float scale = ( det == 0.0 ) ? 0.0 : inversesqrt( det );
		return mat3( T * scale, B * scale, N );
	}
#endif`,dE=`#ifdef USE_CLEARCOAT
	vec3 clearcoatNormal = nonPerturbedNormal;
#endif`,fE=`#ifdef USE_CLEARCOAT_NORMALMAP
	vec3 clearcoatMapN = texture2D( clearcoatNormalMap, vClearcoatNormalMapUv ).xyz * 2.0 - 1.0;
	clearcoatMapN.xy *= clearcoatNormalScale;
	clearcoatNormal = normalize( tbn2 * clearcoatMapN );
#endif`,pE=`#ifdef USE_CLEARCOATMAP
	uniform sampler2D clearcoatMap;
#endif
#ifdef USE_CLEARCOAT_NORMALMAP
	uniform sampler2D clearcoatNormalMap;
	uniform vec2 clearcoatNormalScale;
#endif
#ifdef USE_CLEARCOAT_ROUGHNESSMAP
	uniform sampler2D clearcoatRoughnessMap;
#endif`,mE=`#ifdef USE_IRIDESCENCEMAP
	uniform sampler2D iridescenceMap;
#endif
#ifdef USE_IRIDESCENCE_THICKNESSMAP
	uniform sampler2D iridescenceThicknessMap;
#endif`,gE=`#ifdef OPAQUE
diffuseColor.a = 1.0;
#endif
#ifdef USE_TRANSMISSION
diffuseColor.a *= material.transmissionAlpha;
#endif
gl_FragColor = vec4( outgoingLight, diffuseColor.a );`,_E=`vec3 packNormalToRGB( const in vec3 normal ) {
	return normalize( normal ) * 0.5 + 0.5;
}
vec3 unpackRGBToNormal( const in vec3 rgb ) {
	return 2.0 * rgb.xyz - 1.0;
}
const float PackUpscale = 256. / 255.;const float UnpackDownscale = 255. / 256.;const float ShiftRight8 = 1. / 256.;
const float Inv255 = 1. / 255.;
const vec4 PackFactors = vec4( 1.0, 256.0, 256.0 * 256.0, 256.0 * 256.0 * 256.0 );
const vec2 UnpackFactors2 = vec2( UnpackDownscale, 1.0 / PackFactors.g );
const vec3 UnpackFactors3 = vec3( UnpackDownscale / PackFactors.rg, 1.0 / PackFactors.b );
const vec4 UnpackFactors4 = vec4( UnpackDownscale / PackFactors.rgb, 1.0 / PackFactors.a );
vec4 packDepthToRGBA( const in float v ) {
	if( v <= 0.0 )
		return vec4( 0., 0., 0., 0. );
	if( v >= 1.0 )
		return vec4( 1., 1., 1., 1. );
	float vuf;
	float af = modf( v * PackFactors.a, vuf );
	float bf = modf( vuf * ShiftRight8, vuf );
	float gf = modf( vuf * ShiftRight8, vuf );
	return vec4( vuf * Inv255, gf * PackUpscale, bf * PackUpscale, af );
}
vec3 packDepthToRGB( const in float v ) {
	if( v <= 0.0 )
		return vec3( 0., 0., 0. );
	if( v >= 1.0 )
		return vec3( 1., 1., 1. );
	float vuf;
	float bf = modf( v * PackFactors.b, vuf );
	float gf = modf( vuf * ShiftRight8, vuf );
	return vec3( vuf * Inv255, gf * PackUpscale, bf );
}
vec2 packDepthToRG( const in float v ) {
	if( v <= 0.0 )
		return vec2( 0., 0. );
	if( v >= 1.0 )
		return vec2( 1., 1. );
	float vuf;
	float gf = modf( v * 256., vuf );
	return vec2( vuf * Inv255, gf );
}
float unpackRGBAToDepth( const in vec4 v ) {
	return dot( v, UnpackFactors4 );
}
float unpackRGBToDepth( const in vec3 v ) {
	return dot( v, UnpackFactors3 );
}
float unpackRGToDepth( const in vec2 v ) {
	return v.r * UnpackFactors2.r + v.g * UnpackFactors2.g;
}
vec4 pack2HalfToRGBA( const in vec2 v ) {
	vec4 r = vec4( v.x, fract( v.x * 255.0 ), v.y, fract( v.y * 255.0 ) );
	return vec4( r.x - r.y / 255.0, r.y, r.z - r.w / 255.0, r.w );
}
vec2 unpackRGBATo2Half( const in vec4 v ) {
	return vec2( v.x + ( v.y / 255.0 ), v.z + ( v.w / 255.0 ) );
}
float viewZToOrthographicDepth( const in float viewZ, const in float near, const in float far ) {
	return ( viewZ + near ) / ( near - far );
}
float orthographicDepthToViewZ( const in float depth, const in float near, const in float far ) {
	#ifdef USE_REVERSED_DEPTH_BUFFER
	
		return depth * ( far - near ) - far;
	#else
		return depth * ( near - far ) - near;
	#endif
}
float viewZToPerspectiveDepth( const in float viewZ, const in float near, const in float far ) {
	return ( ( near + viewZ ) * far ) / ( ( far - near ) * viewZ );
}
float perspectiveDepthToViewZ( const in float depth, const in float near, const in float far ) {
	
	#ifdef USE_REVERSED_DEPTH_BUFFER
		return ( near * far ) / ( ( near - far ) * depth - near );
	#else
		return ( near * far ) / ( ( far - near ) * depth - far );
	#endif
}`,vE=`#ifdef PREMULTIPLIED_ALPHA
	gl_FragColor.rgb *= gl_FragColor.a;
#endif`,yE=`vec4 mvPosition = vec4( transformed, 1.0 );
#ifdef USE_BATCHING
	mvPosition = batchingMatrix * mvPosition;
#endif
#ifdef USE_INSTANCING
	mvPosition = instanceMatrix * mvPosition;
#endif
mvPosition = modelViewMatrix * mvPosition;
gl_Position = projectionMatrix * mvPosition;`,xE=`#ifdef DITHERING
	gl_FragColor.rgb = dithering( gl_FragColor.rgb );
#endif`,bE=`#ifdef DITHERING
	vec3 dithering( vec3 color ) {
		float grid_position = rand( gl_FragCoord.xy );
		vec3 dither_shift_RGB = vec3( 0.25 / 255.0, -0.25 / 255.0, 0.25 / 255.0 );
		dither_shift_RGB = mix( 2.0 * dither_shift_RGB, -2.0 * dither_shift_RGB, grid_position );
		return color + dither_shift_RGB;
	}
#endif`,SE=`float roughnessFactor = roughness;
#ifdef USE_ROUGHNESSMAP
	vec4 texelRoughness = texture2D( roughnessMap, vRoughnessMapUv );
	roughnessFactor *= texelRoughness.g;
#endif`,ME=`#ifdef USE_ROUGHNESSMAP
	uniform sampler2D roughnessMap;
#endif`,wE=`#if NUM_SPOT_LIGHT_COORDS > 0
	varying vec4 vSpotLightCoord[ NUM_SPOT_LIGHT_COORDS ];
#endif
#if NUM_SPOT_LIGHT_MAPS > 0
	uniform sampler2D spotLightMap[ NUM_SPOT_LIGHT_MAPS ];
#endif
#ifdef USE_SHADOWMAP
	#if NUM_SUN_LIGHT_SHADOWS > 0
		#define SUN_LIGHT_CASCADES 2
		#if defined( SHADOWMAP_TYPE_PCF )
			uniform sampler2DShadow sunShadowMap[ NUM_SUN_LIGHT_SHADOWS ];
		#else
			uniform sampler2D sunShadowMap[ NUM_SUN_LIGHT_SHADOWS ];
		#endif
		uniform mat4 sunShadowMatrix[ NUM_SUN_LIGHT_SHADOWS * SUN_LIGHT_CASCADES ];
		uniform vec4 sunShadowCascade[ NUM_SUN_LIGHT_SHADOWS * SUN_LIGHT_CASCADES ];
		varying vec4 vSunShadowWorldPosition;
		varying vec3 vSunShadowWorldNormal;
		struct SunLightShadow {
			float shadowIntensity;
			float shadowBias;
			float shadowNormalBias;
			float shadowRadius;
			vec2 shadowMapSize;
		};
		uniform SunLightShadow sunLightShadows[ NUM_SUN_LIGHT_SHADOWS ];
	#endif
	#if NUM_DIR_LIGHT_SHADOWS > 0
		#if defined( SHADOWMAP_TYPE_PCF )
			uniform sampler2DShadow directionalShadowMap[ NUM_DIR_LIGHT_SHADOWS ];
		#else
			uniform sampler2D directionalShadowMap[ NUM_DIR_LIGHT_SHADOWS ];
		#endif
		varying vec4 vDirectionalShadowCoord[ NUM_DIR_LIGHT_SHADOWS ];
		struct DirectionalLightShadow {
			float shadowIntensity;
			float shadowBias;
			float shadowNormalBias;
			float shadowRadius;
			vec2 shadowMapSize;
		};
		uniform DirectionalLightShadow directionalLightShadows[ NUM_DIR_LIGHT_SHADOWS ];
	#endif
	#if NUM_SPOT_LIGHT_SHADOWS > 0
		#if defined( SHADOWMAP_TYPE_PCF )
			uniform sampler2DShadow spotShadowMap[ NUM_SPOT_LIGHT_SHADOWS ];
		#else
			uniform sampler2D spotShadowMap[ NUM_SPOT_LIGHT_SHADOWS ];
		#endif
		struct SpotLightShadow {
			float shadowIntensity;
			float shadowBias;
			float shadowNormalBias;
			float shadowRadius;
			vec2 shadowMapSize;
		};
		uniform SpotLightShadow spotLightShadows[ NUM_SPOT_LIGHT_SHADOWS ];
	#endif
	#if NUM_POINT_LIGHT_SHADOWS > 0
		#if defined( SHADOWMAP_TYPE_PCF )
			uniform samplerCubeShadow pointShadowMap[ NUM_POINT_LIGHT_SHADOWS ];
		#elif defined( SHADOWMAP_TYPE_BASIC )
			uniform samplerCube pointShadowMap[ NUM_POINT_LIGHT_SHADOWS ];
		#endif
		varying vec4 vPointShadowCoord[ NUM_POINT_LIGHT_SHADOWS ];
		struct PointLightShadow {
			float shadowIntensity;
			float shadowBias;
			float shadowNormalBias;
			float shadowRadius;
			vec2 shadowMapSize;
			float shadowCameraNear;
			float shadowCameraFar;
		};
		uniform PointLightShadow pointLightShadows[ NUM_POINT_LIGHT_SHADOWS ];
	#endif
	#if defined( SHADOWMAP_TYPE_PCF )
		float interleavedGradientNoise( vec2 position ) {
			return fract( 52.9829189 * fract( dot( position, vec2( 0.06711056, 0.00583715 ) ) ) );
		}
		vec2 vogelDiskSample( int sampleIndex, int samplesCount, float phi ) {
			const float goldenAngle = 2.399963229728653;
			float r = sqrt( ( float( sampleIndex ) + 0.5 ) / float( samplesCount ) );
			float theta = float( sampleIndex ) * goldenAngle + phi;
			return vec2( cos( theta ), sin( theta ) ) * r;
		}
	#endif
	#if defined( SHADOWMAP_TYPE_PCF )
		float getShadow( sampler2DShadow shadowMap, vec2 shadowMapSize, float shadowIntensity, float shadowBias, float shadowRadius, vec4 shadowCoord ) {
			float shadow = 1.0;
			shadowCoord.xyz /= shadowCoord.w;
			#ifdef USE_REVERSED_DEPTH_BUFFER
				shadowCoord.z -= shadowBias;
			#else
				shadowCoord.z += shadowBias;
			#endif
			bool inFrustum = shadowCoord.x >= 0.0 && shadowCoord.x <= 1.0 && shadowCoord.y >= 0.0 && shadowCoord.y <= 1.0;
			bool frustumTest = inFrustum && shadowCoord.z <= 1.0;
			if ( frustumTest ) {
				vec2 texelSize = vec2( 1.0 ) / shadowMapSize;
				vec2 radius = shadowRadius * texelSize;
				float phi = interleavedGradientNoise( gl_FragCoord.xy ) * PI2;
				shadow = (
					texture( shadowMap, vec3( shadowCoord.xy + vogelDiskSample( 0, 5, phi ) * radius, shadowCoord.z ) ) +
					texture( shadowMap, vec3( shadowCoord.xy + vogelDiskSample( 1, 5, phi ) * radius, shadowCoord.z ) ) +
					texture( shadowMap, vec3( shadowCoord.xy + vogelDiskSample( 2, 5, phi ) * radius, shadowCoord.z ) ) +
					texture( shadowMap, vec3( shadowCoord.xy + vogelDiskSample( 3, 5, phi ) * radius, shadowCoord.z ) ) +
					texture( shadowMap, vec3( shadowCoord.xy + vogelDiskSample( 4, 5, phi ) * radius, shadowCoord.z ) )
				) * 0.2;
			}
			return mix( 1.0, shadow, shadowIntensity );
		}
	#elif defined( SHADOWMAP_TYPE_VSM )
		float getShadow( sampler2D shadowMap, vec2 shadowMapSize, float shadowIntensity, float shadowBias, float shadowRadius, vec4 shadowCoord ) {
			float shadow = 1.0;
			shadowCoord.xyz /= shadowCoord.w;
			#ifdef USE_REVERSED_DEPTH_BUFFER
				shadowCoord.z -= shadowBias;
			#else
				shadowCoord.z += shadowBias;
			#endif
			bool inFrustum = shadowCoord.x >= 0.0 && shadowCoord.x <= 1.0 && shadowCoord.y >= 0.0 && shadowCoord.y <= 1.0;
			bool frustumTest = inFrustum && shadowCoord.z <= 1.0;
			if ( frustumTest ) {
				vec2 distribution = texture2D( shadowMap, shadowCoord.xy ).rg;
				float mean = distribution.x;
				float variance = distribution.y * distribution.y;
				#ifdef USE_REVERSED_DEPTH_BUFFER
					float hard_shadow = step( mean, shadowCoord.z );
				#else
					float hard_shadow = step( shadowCoord.z, mean );
				#endif
				
				if ( hard_shadow == 1.0 ) {
					shadow = 1.0;
				} else {
					variance = max( variance, 0.0000001 );
					float d = shadowCoord.z - mean;
					float p_max = variance / ( variance + d * d );
					p_max = clamp( ( p_max - 0.3 ) / 0.65, 0.0, 1.0 );
					shadow = max( hard_shadow, p_max );
				}
			}
			return mix( 1.0, shadow, shadowIntensity );
		}
	#else
		float getShadow( sampler2D shadowMap, vec2 shadowMapSize, float shadowIntensity, float shadowBias, float shadowRadius, vec4 shadowCoord ) {
			float shadow = 1.0;
			shadowCoord.xyz /= shadowCoord.w;
			#ifdef USE_REVERSED_DEPTH_BUFFER
				shadowCoord.z -= shadowBias;
			#else
				shadowCoord.z += shadowBias;
			#endif
			bool inFrustum = shadowCoord.x >= 0.0 && shadowCoord.x <= 1.0 && shadowCoord.y >= 0.0 && shadowCoord.y <= 1.0;
			bool frustumTest = inFrustum && shadowCoord.z <= 1.0;
			if ( frustumTest ) {
				float depth = texture2D( shadowMap, shadowCoord.xy ).r;
				#ifdef USE_REVERSED_DEPTH_BUFFER
					shadow = step( depth, shadowCoord.z );
				#else
					shadow = step( shadowCoord.z, depth );
				#endif
			}
			return mix( 1.0, shadow, shadowIntensity );
		}
	#endif
	#if NUM_SUN_LIGHT_SHADOWS > 0
		float getSunShadow(
			#if defined( SHADOWMAP_TYPE_PCF )
				sampler2DShadow shadowMap,
			#else
				sampler2D shadowMap,
			#endif
			SunLightShadow sunLightShadow,
			int shadowIndex
		) {
			vec4 shadowWorldPosition = vec4( vSunShadowWorldPosition.xyz + vSunShadowWorldNormal * sunLightShadow.shadowNormalBias, 1.0 );
			float viewDepth = vSunShadowWorldPosition.w;
			int cascadeOffset = shadowIndex * SUN_LIGHT_CASCADES;
			float shadow = 1.0;
			for ( int i = SUN_LIGHT_CASCADES - 1; i >= 0; i -- ) {
				vec4 cascade = sunShadowCascade[ cascadeOffset + i ];
				if ( viewDepth >= cascade.x && viewDepth < cascade.y ) {
					float cascadeShadow = getShadow(
						shadowMap,
						sunLightShadow.shadowMapSize,
						sunLightShadow.shadowIntensity,
						sunLightShadow.shadowBias,
						sunLightShadow.shadowRadius,
						sunShadowMatrix[ cascadeOffset + i ] * shadowWorldPosition
					);
					shadow = mix( cascadeShadow, shadow, smoothstep( cascade.z, cascade.y, viewDepth ) );
				}
			}
			return shadow;
		}
	#endif
	#if NUM_POINT_LIGHT_SHADOWS > 0
	#if defined( SHADOWMAP_TYPE_PCF )
	float getPointShadow( samplerCubeShadow shadowMap, vec2 shadowMapSize, float shadowIntensity, float shadowBias, float shadowRadius, vec4 shadowCoord, float shadowCameraNear, float shadowCameraFar ) {
		float shadow = 1.0;
		vec3 lightToPosition = shadowCoord.xyz;
		vec3 bd3D = normalize( lightToPosition );
		vec3 absVec = abs( lightToPosition );
		float viewSpaceZ = max( max( absVec.x, absVec.y ), absVec.z );
		if ( viewSpaceZ - shadowCameraFar <= 0.0 && viewSpaceZ - shadowCameraNear >= 0.0 ) {
			float lightDistance = length( lightToPosition );
			float depthRange = shadowCameraFar - shadowCameraNear;
			#ifdef USE_REVERSED_DEPTH_BUFFER
				float depthA = - shadowCameraNear / depthRange - shadowBias;
				float depthB = shadowCameraNear * shadowCameraFar / ( depthRange * lightDistance );
			#else
				float depthA = shadowCameraFar / depthRange + shadowBias;
				float depthB = - shadowCameraNear * shadowCameraFar / ( depthRange * lightDistance );
			#endif
			float texelSize = shadowRadius / shadowMapSize.x;
			vec3 absDir = abs( bd3D );
			vec3 tangent = absDir.x > absDir.z ? vec3( 0.0, 1.0, 0.0 ) : vec3( 1.0, 0.0, 0.0 );
			tangent = normalize( cross( bd3D, tangent ) );
			vec3 bitangent = cross( bd3D, tangent );
			float phi = interleavedGradientNoise( gl_FragCoord.xy ) * PI2;
			shadow = 0.0;
			for ( int i = 0; i < 5; i ++ ) {
				vec2 offset = vogelDiskSample( i, 5, phi );
				vec3 direction = bd3D + ( tangent * offset.x + bitangent * offset.y ) * texelSize;
				vec3 absDirection = abs( direction );
				float dp = depthA + depthB / max( max( absDirection.x, absDirection.y ), absDirection.z );
				shadow += texture( shadowMap, vec4( direction, dp ) );
			}
			shadow *= 0.2;
		}
		return mix( 1.0, shadow, shadowIntensity );
	}
	#elif defined( SHADOWMAP_TYPE_BASIC )
	float getPointShadow( samplerCube shadowMap, vec2 shadowMapSize, float shadowIntensity, float shadowBias, float shadowRadius, vec4 shadowCoord, float shadowCameraNear, float shadowCameraFar ) {
		float shadow = 1.0;
		vec3 lightToPosition = shadowCoord.xyz;
		vec3 absVec = abs( lightToPosition );
		float viewSpaceZ = max( max( absVec.x, absVec.y ), absVec.z );
		if ( viewSpaceZ - shadowCameraFar <= 0.0 && viewSpaceZ - shadowCameraNear >= 0.0 ) {
			float dp = ( shadowCameraFar * ( viewSpaceZ - shadowCameraNear ) ) / ( viewSpaceZ * ( shadowCameraFar - shadowCameraNear ) );
			dp += shadowBias;
			vec3 bd3D = normalize( lightToPosition );
			float depth = textureCube( shadowMap, bd3D ).r;
			#ifdef USE_REVERSED_DEPTH_BUFFER
				depth = 1.0 - depth;
			#endif
			shadow = step( dp, depth );
		}
		return mix( 1.0, shadow, shadowIntensity );
	}
	#endif
	#endif
#endif`,EE=`#if NUM_SPOT_LIGHT_COORDS > 0
	uniform mat4 spotLightMatrix[ NUM_SPOT_LIGHT_COORDS ];
	varying vec4 vSpotLightCoord[ NUM_SPOT_LIGHT_COORDS ];
#endif
#ifdef USE_SHADOWMAP
	#if NUM_SUN_LIGHT_SHADOWS > 0
		varying vec4 vSunShadowWorldPosition;
		varying vec3 vSunShadowWorldNormal;
	#endif
	#if NUM_DIR_LIGHT_SHADOWS > 0
		uniform mat4 directionalShadowMatrix[ NUM_DIR_LIGHT_SHADOWS ];
		varying vec4 vDirectionalShadowCoord[ NUM_DIR_LIGHT_SHADOWS ];
		struct DirectionalLightShadow {
			float shadowIntensity;
			float shadowBias;
			float shadowNormalBias;
			float shadowRadius;
			vec2 shadowMapSize;
		};
		uniform DirectionalLightShadow directionalLightShadows[ NUM_DIR_LIGHT_SHADOWS ];
	#endif
	#if NUM_SPOT_LIGHT_SHADOWS > 0
		struct SpotLightShadow {
			float shadowIntensity;
			float shadowBias;
			float shadowNormalBias;
			float shadowRadius;
			vec2 shadowMapSize;
		};
		uniform SpotLightShadow spotLightShadows[ NUM_SPOT_LIGHT_SHADOWS ];
	#endif
	#if NUM_POINT_LIGHT_SHADOWS > 0
		uniform mat4 pointShadowMatrix[ NUM_POINT_LIGHT_SHADOWS ];
		varying vec4 vPointShadowCoord[ NUM_POINT_LIGHT_SHADOWS ];
		struct PointLightShadow {
			float shadowIntensity;
			float shadowBias;
			float shadowNormalBias;
			float shadowRadius;
			vec2 shadowMapSize;
			float shadowCameraNear;
			float shadowCameraFar;
		};
		uniform PointLightShadow pointLightShadows[ NUM_POINT_LIGHT_SHADOWS ];
	#endif
#endif`,TE=`#if ( defined( USE_SHADOWMAP ) && ( NUM_DIR_LIGHT_SHADOWS > 0 || NUM_SUN_LIGHT_SHADOWS > 0 || NUM_POINT_LIGHT_SHADOWS > 0 ) ) || ( NUM_SPOT_LIGHT_COORDS > 0 )
	#ifdef HAS_NORMAL
		vec3 shadowWorldNormal = transformNormalByInverseViewMatrix( transformedNormal, viewMatrix );
	#else
		vec3 shadowWorldNormal = vec3( 0.0 );
	#endif
	vec4 shadowWorldPosition;
#endif
#if defined( USE_SHADOWMAP )
	#if NUM_SUN_LIGHT_SHADOWS > 0
		vSunShadowWorldPosition = vec4( worldPosition.xyz, - mvPosition.z );
		vSunShadowWorldNormal = shadowWorldNormal;
	#endif
	#if NUM_DIR_LIGHT_SHADOWS > 0
		#pragma unroll_loop_start
		for ( int i = 0; i < NUM_DIR_LIGHT_SHADOWS; i ++ ) {
			shadowWorldPosition = worldPosition + vec4( shadowWorldNormal * directionalLightShadows[ i ].shadowNormalBias, 0 );
			vDirectionalShadowCoord[ i ] = directionalShadowMatrix[ i ] * shadowWorldPosition;
		}
		#pragma unroll_loop_end
	#endif
	#if NUM_POINT_LIGHT_SHADOWS > 0
		#pragma unroll_loop_start
		for ( int i = 0; i < NUM_POINT_LIGHT_SHADOWS; i ++ ) {
			shadowWorldPosition = worldPosition + vec4( shadowWorldNormal * pointLightShadows[ i ].shadowNormalBias, 0 );
			vPointShadowCoord[ i ] = pointShadowMatrix[ i ] * shadowWorldPosition;
		}
		#pragma unroll_loop_end
	#endif
#endif
#if NUM_SPOT_LIGHT_COORDS > 0
	#pragma unroll_loop_start
	for ( int i = 0; i < NUM_SPOT_LIGHT_COORDS; i ++ ) {
		shadowWorldPosition = worldPosition;
		#if ( defined( USE_SHADOWMAP ) && UNROLLED_LOOP_INDEX < NUM_SPOT_LIGHT_SHADOWS )
			shadowWorldPosition.xyz += shadowWorldNormal * spotLightShadows[ i ].shadowNormalBias;
		#endif
		vSpotLightCoord[ i ] = spotLightMatrix[ i ] * shadowWorldPosition;
	}
	#pragma unroll_loop_end
#endif`,AE=`float getShadowMask() {
	float shadow = 1.0;
	#ifdef USE_SHADOWMAP
	#if NUM_SUN_LIGHT_SHADOWS > 0
	SunLightShadow sunLight;
	#pragma unroll_loop_start
	for ( int i = 0; i < NUM_SUN_LIGHT_SHADOWS; i ++ ) {
		sunLight = sunLightShadows[ i ];
		shadow *= receiveShadow ? getSunShadow( sunShadowMap[ i ], sunLight, UNROLLED_LOOP_INDEX ) : 1.0;
	}
	#pragma unroll_loop_end
	#endif
	#if NUM_DIR_LIGHT_SHADOWS > 0
	DirectionalLightShadow directionalLight;
	#pragma unroll_loop_start
	for ( int i = 0; i < NUM_DIR_LIGHT_SHADOWS; i ++ ) {
		directionalLight = directionalLightShadows[ i ];
		shadow *= receiveShadow ? getShadow( directionalShadowMap[ i ], directionalLight.shadowMapSize, directionalLight.shadowIntensity, directionalLight.shadowBias, directionalLight.shadowRadius, vDirectionalShadowCoord[ i ] ) : 1.0;
	}
	#pragma unroll_loop_end
	#endif
	#if NUM_SPOT_LIGHT_SHADOWS > 0
	SpotLightShadow spotLight;
	#pragma unroll_loop_start
	for ( int i = 0; i < NUM_SPOT_LIGHT_SHADOWS; i ++ ) {
		spotLight = spotLightShadows[ i ];
		shadow *= receiveShadow ? getShadow( spotShadowMap[ i ], spotLight.shadowMapSize, spotLight.shadowIntensity, spotLight.shadowBias, spotLight.shadowRadius, vSpotLightCoord[ i ] ) : 1.0;
	}
	#pragma unroll_loop_end
	#endif
	#if NUM_POINT_LIGHT_SHADOWS > 0 && ( defined( SHADOWMAP_TYPE_PCF ) || defined( SHADOWMAP_TYPE_BASIC ) )
	PointLightShadow pointLight;
	#pragma unroll_loop_start
	for ( int i = 0; i < NUM_POINT_LIGHT_SHADOWS; i ++ ) {
		pointLight = pointLightShadows[ i ];
		shadow *= receiveShadow ? getPointShadow( pointShadowMap[ i ], pointLight.shadowMapSize, pointLight.shadowIntensity, pointLight.shadowBias, pointLight.shadowRadius, vPointShadowCoord[ i ], pointLight.shadowCameraNear, pointLight.shadowCameraFar ) : 1.0;
	}
	#pragma unroll_loop_end
	#endif
	#endif
	return shadow;
}`,CE=`#ifdef USE_SKINNING
	mat4 boneMatX = getBoneMatrix( skinIndex.x );
	mat4 boneMatY = getBoneMatrix( skinIndex.y );
	mat4 boneMatZ = getBoneMatrix( skinIndex.z );
	mat4 boneMatW = getBoneMatrix( skinIndex.w );
#endif`,RE=`#ifdef USE_SKINNING
	uniform mat4 bindMatrix;
	uniform mat4 bindMatrixInverse;
	uniform highp sampler2D boneTexture;
	mat4 getBoneMatrix( const in float i ) {
		int size = textureSize( boneTexture, 0 ).x;
		int j = int( i ) * 4;
		int x = j % size;
		int y = j / size;
		vec4 v1 = texelFetch( boneTexture, ivec2( x, y ), 0 );
		vec4 v2 = texelFetch( boneTexture, ivec2( x + 1, y ), 0 );
		vec4 v3 = texelFetch( boneTexture, ivec2( x + 2, y ), 0 );
		vec4 v4 = texelFetch( boneTexture, ivec2( x + 3, y ), 0 );
		return mat4( v1, v2, v3, v4 );
	}
#endif`,PE=`#ifdef USE_SKINNING
	vec4 skinVertex = bindMatrix * vec4( transformed, 1.0 );
	vec4 skinned = vec4( 0.0 );
	skinned += boneMatX * skinVertex * skinWeight.x;
	skinned += boneMatY * skinVertex * skinWeight.y;
	skinned += boneMatZ * skinVertex * skinWeight.z;
	skinned += boneMatW * skinVertex * skinWeight.w;
	transformed = ( bindMatrixInverse * skinned ).xyz;
#endif`,IE=`#ifdef USE_SKINNING
	mat4 skinMatrix = mat4( 0.0 );
	skinMatrix += skinWeight.x * boneMatX;
	skinMatrix += skinWeight.y * boneMatY;
	skinMatrix += skinWeight.z * boneMatZ;
	skinMatrix += skinWeight.w * boneMatW;
	skinMatrix = bindMatrixInverse * skinMatrix * bindMatrix;
	objectNormal = vec4( skinMatrix * vec4( objectNormal, 0.0 ) ).xyz;
	#ifdef USE_TANGENT
		objectTangent = vec4( skinMatrix * vec4( objectTangent, 0.0 ) ).xyz;
	#endif
#endif`,LE=`float specularStrength;
#ifdef USE_SPECULARMAP
	vec4 texelSpecular = texture2D( specularMap, vSpecularMapUv );
	specularStrength = texelSpecular.r;
#else
	specularStrength = 1.0;
#endif`,DE=`#ifdef USE_SPECULARMAP
	uniform sampler2D specularMap;
#endif`,NE=`#if defined( TONE_MAPPING )
	gl_FragColor.rgb = toneMapping( gl_FragColor.rgb );
#endif`,UE=`#ifndef saturate
#define saturate( a ) clamp( a, 0.0, 1.0 )
#endif
uniform float toneMappingExposure;
vec3 LinearToneMapping( vec3 color ) {
	return saturate( toneMappingExposure * color );
}
vec3 ReinhardToneMapping( vec3 color ) {
	color *= toneMappingExposure;
	return saturate( color / ( vec3( 1.0 ) + color ) );
}
vec3 CineonToneMapping( vec3 color ) {
	color *= toneMappingExposure;
	color = max( vec3( 0.0 ), color - 0.004 );
	return pow( ( color * ( 6.2 * color + 0.5 ) ) / ( color * ( 6.2 * color + 1.7 ) + 0.06 ), vec3( 2.2 ) );
}
vec3 RRTAndODTFit( vec3 v ) {
	vec3 a = v * ( v + 0.0245786 ) - 0.000090537;
	vec3 b = v * ( 0.983729 * v + 0.4329510 ) + 0.238081;
	return a / b;
}
vec3 ACESFilmicToneMapping( vec3 color ) {
	const mat3 ACESInputMat = mat3(
		vec3( 0.59719, 0.07600, 0.02840 ),		vec3( 0.35458, 0.90834, 0.13383 ),
		vec3( 0.04823, 0.01566, 0.83777 )
	);
	const mat3 ACESOutputMat = mat3(
		vec3(  1.60475, -0.10208, -0.00327 ),		vec3( -0.53108,  1.10813, -0.07276 ),
		vec3( -0.07367, -0.00605,  1.07602 )
	);
	color *= toneMappingExposure / 0.6;
	color = ACESInputMat * color;
	color = RRTAndODTFit( color );
	color = ACESOutputMat * color;
	return saturate( color );
}
const mat3 LINEAR_REC2020_TO_LINEAR_SRGB = mat3(
	vec3( 1.6605, - 0.1246, - 0.0182 ),
	vec3( - 0.5876, 1.1329, - 0.1006 ),
	vec3( - 0.0728, - 0.0083, 1.1187 )
);
const mat3 LINEAR_SRGB_TO_LINEAR_REC2020 = mat3(
	vec3( 0.6274, 0.0691, 0.0164 ),
	vec3( 0.3293, 0.9195, 0.0880 ),
	vec3( 0.0433, 0.0113, 0.8956 )
);
vec3 agxDefaultContrastApprox( vec3 x ) {
	vec3 x2 = x * x;
	vec3 x4 = x2 * x2;
	return + 15.5 * x4 * x2
		- 40.14 * x4 * x
		+ 31.96 * x4
		- 6.868 * x2 * x
		+ 0.4298 * x2
		+ 0.1191 * x
		- 0.00232;
}
vec3 AgXToneMapping( vec3 color ) {
	const mat3 AgXInsetMatrix = mat3(
		vec3( 0.856627153315983, 0.137318972929847, 0.11189821299995 ),
		vec3( 0.0951212405381588, 0.761241990602591, 0.0767994186031903 ),
		vec3( 0.0482516061458583, 0.101439036467562, 0.811302368396859 )
	);
	const mat3 AgXOutsetMatrix = mat3(
		vec3( 1.1271005818144368, - 0.1413297634984383, - 0.14132976349843826 ),
		vec3( - 0.11060664309660323, 1.157823702216272, - 0.11060664309660294 ),
		vec3( - 0.016493938717834573, - 0.016493938717834257, 1.2519364065950405 )
	);
	const float AgxMinEv = - 12.47393;	const float AgxMaxEv = 4.026069;
	color *= toneMappingExposure;
	color = LINEAR_SRGB_TO_LINEAR_REC2020 * color;
	color = AgXInsetMatrix * color;
	color = max( color, 1e-10 );	color = log2( color );
	color = ( color - AgxMinEv ) / ( AgxMaxEv - AgxMinEv );
	color = clamp( color, 0.0, 1.0 );
	color = agxDefaultContrastApprox( color );
	color = AgXOutsetMatrix * color;
	color = pow( max( vec3( 0.0 ), color ), vec3( 2.2 ) );
	color = LINEAR_REC2020_TO_LINEAR_SRGB * color;
	color = clamp( color, 0.0, 1.0 );
	return color;
}
vec3 NeutralToneMapping( vec3 color ) {
	const float StartCompression = 0.8 - 0.04;
	const float Desaturation = 0.15;
	color *= toneMappingExposure;
	float x = min( color.r, min( color.g, color.b ) );
	float offset = x < 0.08 ? x - 6.25 * x * x : 0.04;
	color -= offset;
	float peak = max( color.r, max( color.g, color.b ) );
	if ( peak < StartCompression ) return color;
	float d = 1. - StartCompression;
	float newPeak = 1. - d * d / ( peak + d - StartCompression );
	color *= newPeak / peak;
	float g = 1. - 1. / ( Desaturation * ( peak - newPeak ) + 1. );
	return mix( color, vec3( newPeak ), g );
}
vec3 CustomToneMapping( vec3 color ) { return color; }`,OE=`#ifdef USE_TRANSMISSION
	material.transmission = transmission;
	material.transmissionAlpha = 1.0;
	material.thickness = thickness;
	material.attenuationDistance = attenuationDistance;
	material.attenuationColor = attenuationColor;
	#ifdef USE_TRANSMISSIONMAP
		material.transmission *= texture2D( transmissionMap, vTransmissionMapUv ).r;
	#endif
	#ifdef USE_THICKNESSMAP
		material.thickness *= texture2D( thicknessMap, vThicknessMapUv ).g;
	#endif
	vec3 pos = vWorldPosition;
	vec3 v = normalize( cameraPosition - pos );
	vec3 n = transformNormalByInverseViewMatrix( normal, viewMatrix );
	vec4 transmitted = getIBLVolumeRefraction(
		n, v, material.roughness, material.diffuseContribution, material.specularColorBlended, material.specularF90,
		pos, modelMatrix, viewMatrix, projectionMatrix, material.dispersion, material.ior, material.thickness,
		material.attenuationColor, material.attenuationDistance );
	material.transmissionAlpha = mix( material.transmissionAlpha, transmitted.a, material.transmission );
	totalDiffuse = mix( totalDiffuse, transmitted.rgb, material.transmission );
#endif`,FE=`#ifdef USE_TRANSMISSION
	uniform float transmission;
	uniform float thickness;
	uniform float attenuationDistance;
	uniform vec3 attenuationColor;
	#ifdef USE_TRANSMISSIONMAP
		uniform sampler2D transmissionMap;
	#endif
	#ifdef USE_THICKNESSMAP
		uniform sampler2D thicknessMap;
	#endif
	uniform vec2 transmissionSamplerSize;
	uniform sampler2D transmissionSamplerMap;
	uniform mat4 modelMatrix;
	uniform mat4 projectionMatrix;
	varying vec3 vWorldPosition;
	float w0( float a ) {
		return ( 1.0 / 6.0 ) * ( a * ( a * ( - a + 3.0 ) - 3.0 ) + 1.0 );
	}
	float w1( float a ) {
		return ( 1.0 / 6.0 ) * ( a *  a * ( 3.0 * a - 6.0 ) + 4.0 );
	}
	float w2( float a ){
		return ( 1.0 / 6.0 ) * ( a * ( a * ( - 3.0 * a + 3.0 ) + 3.0 ) + 1.0 );
	}
	float w3( float a ) {
		return ( 1.0 / 6.0 ) * ( a * a * a );
	}
	float g0( float a ) {
		return w0( a ) + w1( a );
	}
	float g1( float a ) {
		return w2( a ) + w3( a );
	}
	float h0( float a ) {
		return - 1.0 + w1( a ) / ( w0( a ) + w1( a ) );
	}
	float h1( float a ) {
		return 1.0 + w3( a ) / ( w2( a ) + w3( a ) );
	}
	vec4 bicubic( sampler2D tex, vec2 uv, vec4 texelSize, float lod ) {
		uv = uv * texelSize.zw + 0.5;
		vec2 iuv = floor( uv );
		vec2 fuv = fract( uv );
		float g0x = g0( fuv.x );
		float g1x = g1( fuv.x );
		float h0x = h0( fuv.x );
		float h1x = h1( fuv.x );
		float h0y = h0( fuv.y );
		float h1y = h1( fuv.y );
		vec2 p0 = ( vec2( iuv.x + h0x, iuv.y + h0y ) - 0.5 ) * texelSize.xy;
		vec2 p1 = ( vec2( iuv.x + h1x, iuv.y + h0y ) - 0.5 ) * texelSize.xy;
		vec2 p2 = ( vec2( iuv.x + h0x, iuv.y + h1y ) - 0.5 ) * texelSize.xy;
		vec2 p3 = ( vec2( iuv.x + h1x, iuv.y + h1y ) - 0.5 ) * texelSize.xy;
		return g0( fuv.y ) * ( g0x * textureLod( tex, p0, lod ) + g1x * textureLod( tex, p1, lod ) ) +
			g1( fuv.y ) * ( g0x * textureLod( tex, p2, lod ) + g1x * textureLod( tex, p3, lod ) );
	}
	vec4 textureBicubic( sampler2D sampler, vec2 uv, float lod ) {
		vec2 fLodSize = vec2( textureSize( sampler, int( lod ) ) );
		vec2 cLodSize = vec2( textureSize( sampler, int( lod + 1.0 ) ) );
		vec2 fLodSizeInv = 1.0 / fLodSize;
		vec2 cLodSizeInv = 1.0 / cLodSize;
		vec4 fSample = bicubic( sampler, uv, vec4( fLodSizeInv, fLodSize ), floor( lod ) );
		vec4 cSample = bicubic( sampler, uv, vec4( cLodSizeInv, cLodSize ), ceil( lod ) );
		return mix( fSample, cSample, fract( lod ) );
	}
	vec3 getVolumeTransmissionRay( const in vec3 n, const in vec3 v, const in float thickness, const in float ior, const in mat4 modelMatrix ) {
		vec3 refractionVector = refract( - v, normalize( n ), 1.0 / ior );
		vec3 modelScale;
		modelScale.x = length( vec3( modelMatrix[ 0 ].xyz ) );
		modelScale.y = length( vec3( modelMatrix[ 1 ].xyz ) );
		modelScale.z = length( vec3( modelMatrix[ 2 ].xyz ) );
		return normalize( refractionVector ) * thickness * modelScale;
	}
	float applyIorToRoughness( const in float roughness, const in float ior ) {
		return roughness * clamp( ior * 2.0 - 2.0, 0.0, 1.0 );
	}
	vec4 getTransmissionSample( const in vec2 fragCoord, const in float roughness, const in float ior ) {
		float lod = log2( transmissionSamplerSize.x ) * applyIorToRoughness( roughness, ior );
		return textureBicubic( transmissionSamplerMap, fragCoord.xy, lod );
	}
	vec3 volumeAttenuation( const in float transmissionDistance, const in vec3 attenuationColor, const in float attenuationDistance ) {
		if ( isinf( attenuationDistance ) ) {
			return vec3( 1.0 );
		} else {
			vec3 attenuationCoefficient = -log( attenuationColor ) / attenuationDistance;
			vec3 transmittance = exp( - attenuationCoefficient * transmissionDistance );			return transmittance;
		}
	}
	vec4 getIBLVolumeRefraction( const in vec3 n, const in vec3 v, const in float roughness, const in vec3 diffuseColor,
		const in vec3 specularColor, const in float specularF90, const in vec3 position, const in mat4 modelMatrix,
		const in mat4 viewMatrix, const in mat4 projMatrix, const in float dispersion, const in float ior, const in float thickness,
		const in vec3 attenuationColor, const in float attenuationDistance ) {
		vec4 transmittedLight;
		vec3 transmittance;
		#ifdef USE_DISPERSION
			float halfSpread = ( ior - 1.0 ) * 0.025 * dispersion;
			vec3 iors = vec3( ior - halfSpread, ior, ior + halfSpread );
			for ( int i = 0; i < 3; i ++ ) {
				vec3 transmissionRay = getVolumeTransmissionRay( n, v, thickness, iors[ i ], modelMatrix );
				vec3 refractedRayExit = position + transmissionRay;
				vec4 ndcPos = projMatrix * viewMatrix * vec4( refractedRayExit, 1.0 );
				vec2 refractionCoords = ndcPos.xy / ndcPos.w;
				refractionCoords += 1.0;
				refractionCoords /= 2.0;
				vec4 transmissionSample = getTransmissionSample( refractionCoords, roughness, iors[ i ] );
				transmittedLight[ i ] = transmissionSample[ i ];
				transmittedLight.a += transmissionSample.a;
				transmittance[ i ] = diffuseColor[ i ] * volumeAttenuation( length( transmissionRay ), attenuationColor, attenuationDistance )[ i ];
			}
			transmittedLight.a /= 3.0;
		#else
			vec3 transmissionRay = getVolumeTransmissionRay( n, v, thickness, ior, modelMatrix );
			vec3 refractedRayExit = position + transmissionRay;
			vec4 ndcPos = projMatrix * viewMatrix * vec4( refractedRayExit, 1.0 );
			vec2 refractionCoords = ndcPos.xy / ndcPos.w;
			refractionCoords += 1.0;
			refractionCoords /= 2.0;
			transmittedLight = getTransmissionSample( refractionCoords, roughness, ior );
			transmittance = diffuseColor * volumeAttenuation( length( transmissionRay ), attenuationColor, attenuationDistance );
		#endif
		vec3 attenuatedColor = transmittance * transmittedLight.rgb;
		vec3 F = EnvironmentBRDF( n, v, specularColor, specularF90, roughness );
		float transmittanceFactor = ( transmittance.r + transmittance.g + transmittance.b ) / 3.0;
		return vec4( ( 1.0 - F ) * attenuatedColor, 1.0 - ( 1.0 - transmittedLight.a ) * transmittanceFactor );
	}
#endif`,BE=`#if defined( USE_UV ) || defined( USE_ANISOTROPY )
	varying vec2 vUv;
#endif
#ifdef USE_MAP
	varying vec2 vMapUv;
#endif
#ifdef USE_ALPHAMAP
	varying vec2 vAlphaMapUv;
#endif
#ifdef USE_LIGHTMAP
	varying vec2 vLightMapUv;
#endif
#ifdef USE_AOMAP
	varying vec2 vAoMapUv;
#endif
#ifdef USE_BUMPMAP
	varying vec2 vBumpMapUv;
#endif
#ifdef USE_NORMALMAP
	varying vec2 vNormalMapUv;
#endif
#ifdef USE_EMISSIVEMAP
	varying vec2 vEmissiveMapUv;
#endif
#ifdef USE_METALNESSMAP
	varying vec2 vMetalnessMapUv;
#endif
#ifdef USE_ROUGHNESSMAP
	varying vec2 vRoughnessMapUv;
#endif
#ifdef USE_DIFFUSE_ROUGHNESSMAP
	varying vec2 vDiffuseRoughnessMapUv;
#endif
#ifdef USE_ANISOTROPYMAP
	varying vec2 vAnisotropyMapUv;
#endif
#ifdef USE_CLEARCOATMAP
	varying vec2 vClearcoatMapUv;
#endif
#ifdef USE_CLEARCOAT_NORMALMAP
	varying vec2 vClearcoatNormalMapUv;
#endif
#ifdef USE_CLEARCOAT_ROUGHNESSMAP
	varying vec2 vClearcoatRoughnessMapUv;
#endif
#ifdef USE_IRIDESCENCEMAP
	varying vec2 vIridescenceMapUv;
#endif
#ifdef USE_IRIDESCENCE_THICKNESSMAP
	varying vec2 vIridescenceThicknessMapUv;
#endif
#ifdef USE_SHEEN_COLORMAP
	varying vec2 vSheenColorMapUv;
#endif
#ifdef USE_SHEEN_ROUGHNESSMAP
	varying vec2 vSheenRoughnessMapUv;
#endif
#ifdef USE_SPECULARMAP
	varying vec2 vSpecularMapUv;
#endif
#ifdef USE_SPECULAR_COLORMAP
	varying vec2 vSpecularColorMapUv;
#endif
#ifdef USE_SPECULAR_INTENSITYMAP
	varying vec2 vSpecularIntensityMapUv;
#endif
#ifdef USE_TRANSMISSIONMAP
	uniform mat3 transmissionMapTransform;
	varying vec2 vTransmissionMapUv;
#endif
#ifdef USE_THICKNESSMAP
	uniform mat3 thicknessMapTransform;
	varying vec2 vThicknessMapUv;
#endif`,kE=`#if defined( USE_UV ) || defined( USE_ANISOTROPY )
	varying vec2 vUv;
#endif
#ifdef USE_MAP
	uniform mat3 mapTransform;
	varying vec2 vMapUv;
#endif
#ifdef USE_ALPHAMAP
	uniform mat3 alphaMapTransform;
	varying vec2 vAlphaMapUv;
#endif
#ifdef USE_LIGHTMAP
	uniform mat3 lightMapTransform;
	varying vec2 vLightMapUv;
#endif
#ifdef USE_AOMAP
	uniform mat3 aoMapTransform;
	varying vec2 vAoMapUv;
#endif
#ifdef USE_BUMPMAP
	uniform mat3 bumpMapTransform;
	varying vec2 vBumpMapUv;
#endif
#ifdef USE_NORMALMAP
	uniform mat3 normalMapTransform;
	varying vec2 vNormalMapUv;
#endif
#ifdef USE_DISPLACEMENTMAP
	uniform mat3 displacementMapTransform;
	varying vec2 vDisplacementMapUv;
#endif
#ifdef USE_EMISSIVEMAP
	uniform mat3 emissiveMapTransform;
	varying vec2 vEmissiveMapUv;
#endif
#ifdef USE_METALNESSMAP
	uniform mat3 metalnessMapTransform;
	varying vec2 vMetalnessMapUv;
#endif
#ifdef USE_ROUGHNESSMAP
	uniform mat3 roughnessMapTransform;
	varying vec2 vRoughnessMapUv;
#endif
#ifdef USE_DIFFUSE_ROUGHNESSMAP
	uniform mat3 diffuseRoughnessMapTransform;
	varying vec2 vDiffuseRoughnessMapUv;
#endif
#ifdef USE_ANISOTROPYMAP
	uniform mat3 anisotropyMapTransform;
	varying vec2 vAnisotropyMapUv;
#endif
#ifdef USE_CLEARCOATMAP
	uniform mat3 clearcoatMapTransform;
	varying vec2 vClearcoatMapUv;
#endif
#ifdef USE_CLEARCOAT_NORMALMAP
	uniform mat3 clearcoatNormalMapTransform;
	varying vec2 vClearcoatNormalMapUv;
#endif
#ifdef USE_CLEARCOAT_ROUGHNESSMAP
	uniform mat3 clearcoatRoughnessMapTransform;
	varying vec2 vClearcoatRoughnessMapUv;
#endif
#ifdef USE_SHEEN_COLORMAP
	uniform mat3 sheenColorMapTransform;
	varying vec2 vSheenColorMapUv;
#endif
#ifdef USE_SHEEN_ROUGHNESSMAP
	uniform mat3 sheenRoughnessMapTransform;
	varying vec2 vSheenRoughnessMapUv;
#endif
#ifdef USE_IRIDESCENCEMAP
	uniform mat3 iridescenceMapTransform;
	varying vec2 vIridescenceMapUv;
#endif
#ifdef USE_IRIDESCENCE_THICKNESSMAP
	uniform mat3 iridescenceThicknessMapTransform;
	varying vec2 vIridescenceThicknessMapUv;
#endif
#ifdef USE_SPECULARMAP
	uniform mat3 specularMapTransform;
	varying vec2 vSpecularMapUv;
#endif
#ifdef USE_SPECULAR_COLORMAP
	uniform mat3 specularColorMapTransform;
	varying vec2 vSpecularColorMapUv;
#endif
#ifdef USE_SPECULAR_INTENSITYMAP
	uniform mat3 specularIntensityMapTransform;
	varying vec2 vSpecularIntensityMapUv;
#endif
#ifdef USE_TRANSMISSIONMAP
	uniform mat3 transmissionMapTransform;
	varying vec2 vTransmissionMapUv;
#endif
#ifdef USE_THICKNESSMAP
	uniform mat3 thicknessMapTransform;
	varying vec2 vThicknessMapUv;
#endif`,zE=`#if defined( USE_UV ) || defined( USE_ANISOTROPY )
	vUv = vec3( uv, 1 ).xy;
#endif
#ifdef USE_MAP
	vMapUv = ( mapTransform * vec3( MAP_UV, 1 ) ).xy;
#endif
#ifdef USE_ALPHAMAP
	vAlphaMapUv = ( alphaMapTransform * vec3( ALPHAMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_LIGHTMAP
	vLightMapUv = ( lightMapTransform * vec3( LIGHTMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_AOMAP
	vAoMapUv = ( aoMapTransform * vec3( AOMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_BUMPMAP
	vBumpMapUv = ( bumpMapTransform * vec3( BUMPMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_NORMALMAP
	vNormalMapUv = ( normalMapTransform * vec3( NORMALMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_DISPLACEMENTMAP
	vDisplacementMapUv = ( displacementMapTransform * vec3( DISPLACEMENTMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_EMISSIVEMAP
	vEmissiveMapUv = ( emissiveMapTransform * vec3( EMISSIVEMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_METALNESSMAP
	vMetalnessMapUv = ( metalnessMapTransform * vec3( METALNESSMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_ROUGHNESSMAP
	vRoughnessMapUv = ( roughnessMapTransform * vec3( ROUGHNESSMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_DIFFUSE_ROUGHNESSMAP
	vDiffuseRoughnessMapUv = ( diffuseRoughnessMapTransform * vec3( DIFFUSE_ROUGHNESSMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_ANISOTROPYMAP
	vAnisotropyMapUv = ( anisotropyMapTransform * vec3( ANISOTROPYMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_CLEARCOATMAP
	vClearcoatMapUv = ( clearcoatMapTransform * vec3( CLEARCOATMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_CLEARCOAT_NORMALMAP
	vClearcoatNormalMapUv = ( clearcoatNormalMapTransform * vec3( CLEARCOAT_NORMALMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_CLEARCOAT_ROUGHNESSMAP
	vClearcoatRoughnessMapUv = ( clearcoatRoughnessMapTransform * vec3( CLEARCOAT_ROUGHNESSMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_IRIDESCENCEMAP
	vIridescenceMapUv = ( iridescenceMapTransform * vec3( IRIDESCENCEMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_IRIDESCENCE_THICKNESSMAP
	vIridescenceThicknessMapUv = ( iridescenceThicknessMapTransform * vec3( IRIDESCENCE_THICKNESSMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_SHEEN_COLORMAP
	vSheenColorMapUv = ( sheenColorMapTransform * vec3( SHEEN_COLORMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_SHEEN_ROUGHNESSMAP
	vSheenRoughnessMapUv = ( sheenRoughnessMapTransform * vec3( SHEEN_ROUGHNESSMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_SPECULARMAP
	vSpecularMapUv = ( specularMapTransform * vec3( SPECULARMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_SPECULAR_COLORMAP
	vSpecularColorMapUv = ( specularColorMapTransform * vec3( SPECULAR_COLORMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_SPECULAR_INTENSITYMAP
	vSpecularIntensityMapUv = ( specularIntensityMapTransform * vec3( SPECULAR_INTENSITYMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_TRANSMISSIONMAP
	vTransmissionMapUv = ( transmissionMapTransform * vec3( TRANSMISSIONMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_THICKNESSMAP
	vThicknessMapUv = ( thicknessMapTransform * vec3( THICKNESSMAP_UV, 1 ) ).xy;
#endif`,VE=`#if defined( USE_ENVMAP ) || defined( DISTANCE ) || defined ( USE_SHADOWMAP ) || defined ( USE_TRANSMISSION ) || NUM_SPOT_LIGHT_COORDS > 0
	vec4 worldPosition = vec4( transformed, 1.0 );
	#ifdef USE_BATCHING
		worldPosition = batchingMatrix * worldPosition;
	#endif
	#ifdef USE_INSTANCING
		worldPosition = instanceMatrix * worldPosition;
	#endif
	worldPosition = modelMatrix * worldPosition;
#endif`,HE=`varying vec2 vUv;
uniform mat3 uvTransform;
void main() {
	vUv = ( uvTransform * vec3( uv, 1 ) ).xy;
	gl_Position = vec4( position.xy, 1.0, 1.0 );
}`,$E=`uniform sampler2D t2D;
uniform float backgroundIntensity;
varying vec2 vUv;
void main() {
	vec4 texColor = texture2D( t2D, vUv );
	#ifdef DECODE_VIDEO_TEXTURE
		texColor = vec4( mix( pow( texColor.rgb * 0.9478672986 + vec3( 0.0521327014 ), vec3( 2.4 ) ), texColor.rgb * 0.0773993808, vec3( lessThanEqual( texColor.rgb, vec3( 0.04045 ) ) ) ), texColor.w );
	#endif
	texColor.rgb *= backgroundIntensity;
	gl_FragColor = texColor;
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
}`,GE=`varying vec3 vWorldDirection;
#include <common>
void main() {
	vWorldDirection = transformDirection( position, modelMatrix );
	#include <begin_vertex>
	#include <project_vertex>
	gl_Position.z = gl_Position.w;
}`,WE=`uniform float backgroundBlurriness;
uniform float backgroundIntensity;
uniform mat3 backgroundRotation;
varying vec3 vWorldDirection;
#include <envmap_common_pars_fragment>
void main() {
	#ifdef ENVMAP_TYPE_PMREM
		vec4 texColor = textureLod( envMap, backgroundRotation * vWorldDirection, roughnessToMip( backgroundBlurriness ) );
	#else
		vec4 texColor = textureCube( envMap, backgroundRotation * vWorldDirection );
	#endif
	texColor.rgb *= backgroundIntensity;
	gl_FragColor = texColor;
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
}`,XE=`varying vec3 vWorldDirection;
#include <common>
void main() {
	vWorldDirection = transformDirection( position, modelMatrix );
	#include <begin_vertex>
	#include <project_vertex>
	gl_Position.z = gl_Position.w;
}`,qE=`uniform samplerCube tCube;
uniform float tFlip;
uniform float opacity;
varying vec3 vWorldDirection;
void main() {
	vec4 texColor = textureCube( tCube, vec3( tFlip * vWorldDirection.x, vWorldDirection.yz ) );
	gl_FragColor = texColor;
	gl_FragColor.a *= opacity;
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
}`,YE=`#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <displacementmap_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
varying vec2 vHighPrecisionZW;
void main() {
	#include <uv_vertex>
	#include <batching_vertex>
	#include <skinbase_vertex>
	#include <morphinstance_vertex>
	#ifdef USE_DISPLACEMENTMAP
		#include <beginnormal_vertex>
		#include <morphnormal_vertex>
		#include <skinnormal_vertex>
	#endif
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <skinning_vertex>
	#include <displacementmap_vertex>
	#include <project_vertex>
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
	vHighPrecisionZW = gl_Position.zw;
}`,jE=`#if DEPTH_PACKING == 3200
	uniform float opacity;
#endif
#include <common>
#include <packing>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
varying vec2 vHighPrecisionZW;
void main() {
	vec4 diffuseColor = vec4( 1.0 );
	#include <clipping_planes_fragment>
	#if DEPTH_PACKING == 3200
		diffuseColor.a = opacity;
	#endif
	#include <map_fragment>
	#include <alphamap_fragment>
	#include <alphatest_fragment>
	#include <alphahash_fragment>
	#include <logdepthbuf_fragment>
	#ifdef USE_REVERSED_DEPTH_BUFFER
		float fragCoordZ = vHighPrecisionZW[ 0 ] / vHighPrecisionZW[ 1 ];
	#else
		float fragCoordZ = 0.5 * vHighPrecisionZW[ 0 ] / vHighPrecisionZW[ 1 ] + 0.5;
	#endif
	#if DEPTH_PACKING == 3200
		gl_FragColor = vec4( vec3( 1.0 - fragCoordZ ), opacity );
	#elif DEPTH_PACKING == 3201
		gl_FragColor = packDepthToRGBA( fragCoordZ );
	#elif DEPTH_PACKING == 3202
		gl_FragColor = vec4( packDepthToRGB( fragCoordZ ), 1.0 );
	#elif DEPTH_PACKING == 3203
		gl_FragColor = vec4( packDepthToRG( fragCoordZ ), 0.0, 1.0 );
	#endif
}`,ZE=`#define DISTANCE
varying vec3 vWorldPosition;
#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <displacementmap_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
	#include <uv_vertex>
	#include <batching_vertex>
	#include <skinbase_vertex>
	#include <morphinstance_vertex>
	#ifdef USE_DISPLACEMENTMAP
		#include <beginnormal_vertex>
		#include <morphnormal_vertex>
		#include <skinnormal_vertex>
	#endif
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <skinning_vertex>
	#include <displacementmap_vertex>
	#include <project_vertex>
	#include <worldpos_vertex>
	#include <clipping_planes_vertex>
	vWorldPosition = worldPosition.xyz;
}`,JE=`#define DISTANCE
uniform vec3 referencePosition;
uniform float nearDistance;
uniform float farDistance;
varying vec3 vWorldPosition;
#include <common>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( 1.0 );
	#include <clipping_planes_fragment>
	#include <map_fragment>
	#include <alphamap_fragment>
	#include <alphatest_fragment>
	#include <alphahash_fragment>
	float dist = length( vWorldPosition - referencePosition );
	dist = ( dist - nearDistance ) / ( farDistance - nearDistance );
	dist = saturate( dist );
	gl_FragColor = vec4( dist, 0.0, 0.0, 1.0 );
}`,KE=`varying vec3 vWorldDirection;
#include <common>
void main() {
	vWorldDirection = transformDirection( position, modelMatrix );
	#include <begin_vertex>
	#include <project_vertex>
}`,QE=`uniform sampler2D tEquirect;
varying vec3 vWorldDirection;
#include <common>
void main() {
	vec3 direction = normalize( vWorldDirection );
	vec2 sampleUV = equirectUv( direction );
	gl_FragColor = texture2D( tEquirect, sampleUV );
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
}`,eT=`uniform float scale;
attribute float lineDistance;
varying float vLineDistance;
#include <common>
#include <uv_pars_vertex>
#include <color_pars_vertex>
#include <fog_pars_vertex>
#include <morphtarget_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
	vLineDistance = scale * lineDistance;
	#include <uv_vertex>
	#include <color_vertex>
	#include <morphinstance_vertex>
	#include <morphcolor_vertex>
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <project_vertex>
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
	#include <fog_vertex>
}`,tT=`uniform vec3 diffuse;
uniform float opacity;
uniform float dashSize;
uniform float totalSize;
varying float vLineDistance;
#include <common>
#include <color_pars_fragment>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <fog_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( diffuse, opacity );
	#include <clipping_planes_fragment>
	if ( mod( vLineDistance, totalSize ) > dashSize ) {
		discard;
	}
	vec3 outgoingLight = vec3( 0.0 );
	#include <logdepthbuf_fragment>
	#include <map_fragment>
	#include <color_fragment>
	outgoingLight = diffuseColor.rgb;
	#include <opaque_fragment>
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
	#include <fog_fragment>
	#include <premultiplied_alpha_fragment>
}`,nT=`#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <envmap_pars_vertex>
#include <color_pars_vertex>
#include <fog_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
	#include <uv_vertex>
	#include <color_vertex>
	#include <morphinstance_vertex>
	#include <morphcolor_vertex>
	#include <batching_vertex>
	#if defined ( USE_ENVMAP ) || defined ( USE_SKINNING )
		#include <beginnormal_vertex>
		#include <morphnormal_vertex>
		#include <skinbase_vertex>
		#include <skinnormal_vertex>
		#include <defaultnormal_vertex>
	#endif
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <skinning_vertex>
	#include <project_vertex>
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
	#include <worldpos_vertex>
	#include <envmap_vertex>
	#include <fog_vertex>
}`,iT=`uniform vec3 diffuse;
uniform float opacity;
#ifndef FLAT_SHADED
	varying vec3 vNormal;
#endif
#include <common>
#include <dithering_pars_fragment>
#include <color_pars_fragment>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <aomap_pars_fragment>
#include <lightmap_pars_fragment>
#include <envmap_common_pars_fragment>
#include <envmap_pars_fragment>
#include <fog_pars_fragment>
#include <specularmap_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( diffuse, opacity );
	#include <clipping_planes_fragment>
	#include <logdepthbuf_fragment>
	#include <map_fragment>
	#include <color_fragment>
	#include <alphamap_fragment>
	#include <alphatest_fragment>
	#include <alphahash_fragment>
	#include <specularmap_fragment>
	ReflectedLight reflectedLight = ReflectedLight( vec3( 0.0 ), vec3( 0.0 ), vec3( 0.0 ), vec3( 0.0 ) );
	#ifdef USE_LIGHTMAP
		vec4 lightMapTexel = texture2D( lightMap, vLightMapUv );
		reflectedLight.indirectDiffuse += lightMapTexel.rgb * lightMapIntensity * RECIPROCAL_PI;
	#else
		reflectedLight.indirectDiffuse += vec3( 1.0 );
	#endif
	#include <aomap_fragment>
	reflectedLight.indirectDiffuse *= diffuseColor.rgb;
	vec3 outgoingLight = reflectedLight.indirectDiffuse;
	#include <envmap_fragment>
	#include <opaque_fragment>
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
	#include <fog_fragment>
	#include <premultiplied_alpha_fragment>
	#include <dithering_fragment>
}`,sT=`#define LAMBERT
varying vec3 vViewPosition;
#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <displacementmap_pars_vertex>
#include <envmap_pars_vertex>
#include <color_pars_vertex>
#include <fog_pars_vertex>
#include <normal_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <shadowmap_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
	#include <uv_vertex>
	#include <color_vertex>
	#include <morphinstance_vertex>
	#include <morphcolor_vertex>
	#include <batching_vertex>
	#include <beginnormal_vertex>
	#include <morphnormal_vertex>
	#include <skinbase_vertex>
	#include <skinnormal_vertex>
	#include <defaultnormal_vertex>
	#include <normal_vertex>
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <skinning_vertex>
	#include <displacementmap_vertex>
	#include <project_vertex>
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
	vViewPosition = - mvPosition.xyz;
	#include <worldpos_vertex>
	#include <envmap_vertex>
	#include <shadowmap_vertex>
	#include <fog_vertex>
}`,rT=`#define LAMBERT
uniform vec3 diffuse;
uniform vec3 emissive;
uniform float opacity;
#include <common>
#include <dithering_pars_fragment>
#include <color_pars_fragment>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <aomap_pars_fragment>
#include <lightmap_pars_fragment>
#include <emissivemap_pars_fragment>
#include <envmap_common_pars_fragment>
#include <envmap_pars_fragment>
#include <envmap_physical_pars_fragment>
#include <fog_pars_fragment>
#include <bsdfs>
#include <lights_pars_begin>
#include <normal_pars_fragment>
#include <lights_lambert_pars_fragment>
#include <shadowmap_pars_fragment>
#include <bumpmap_pars_fragment>
#include <normalmap_pars_fragment>
#include <specularmap_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( diffuse, opacity );
	#include <clipping_planes_fragment>
	ReflectedLight reflectedLight = ReflectedLight( vec3( 0.0 ), vec3( 0.0 ), vec3( 0.0 ), vec3( 0.0 ) );
	vec3 totalEmissiveRadiance = emissive;
	#include <logdepthbuf_fragment>
	#include <map_fragment>
	#include <color_fragment>
	#include <alphamap_fragment>
	#include <alphatest_fragment>
	#include <alphahash_fragment>
	#include <specularmap_fragment>
	#include <normal_fragment_begin>
	#include <normal_fragment_maps>
	#include <emissivemap_fragment>
	#include <lights_lambert_fragment>
	#include <lights_fragment_begin>
	#include <lights_fragment_maps>
	#include <lights_fragment_end>
	#include <aomap_fragment>
	vec3 outgoingLight = reflectedLight.directDiffuse + reflectedLight.indirectDiffuse + totalEmissiveRadiance;
	#include <envmap_fragment>
	#include <opaque_fragment>
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
	#include <fog_fragment>
	#include <premultiplied_alpha_fragment>
	#include <dithering_fragment>
}`,oT=`#define MATCAP
varying vec3 vViewPosition;
#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <color_pars_vertex>
#include <displacementmap_pars_vertex>
#include <fog_pars_vertex>
#include <normal_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
	#include <uv_vertex>
	#include <color_vertex>
	#include <morphinstance_vertex>
	#include <morphcolor_vertex>
	#include <batching_vertex>
	#include <beginnormal_vertex>
	#include <morphnormal_vertex>
	#include <skinbase_vertex>
	#include <skinnormal_vertex>
	#include <defaultnormal_vertex>
	#include <normal_vertex>
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <skinning_vertex>
	#include <displacementmap_vertex>
	#include <project_vertex>
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
	#include <fog_vertex>
	vViewPosition = - mvPosition.xyz;
}`,aT=`#define MATCAP
uniform vec3 diffuse;
uniform float opacity;
uniform sampler2D matcap;
varying vec3 vViewPosition;
#include <common>
#include <dithering_pars_fragment>
#include <color_pars_fragment>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <fog_pars_fragment>
#include <normal_pars_fragment>
#include <bumpmap_pars_fragment>
#include <normalmap_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( diffuse, opacity );
	#include <clipping_planes_fragment>
	#include <logdepthbuf_fragment>
	#include <map_fragment>
	#include <color_fragment>
	#include <alphamap_fragment>
	#include <alphatest_fragment>
	#include <alphahash_fragment>
	#include <normal_fragment_begin>
	#include <normal_fragment_maps>
	vec3 viewDir = normalize( vViewPosition );
	vec3 x = normalize( vec3( viewDir.z, 0.0, - viewDir.x ) );
	vec3 y = cross( viewDir, x );
	vec2 uv = vec2( dot( x, normal ), dot( y, normal ) ) * 0.495 + 0.5;
	#ifdef USE_MATCAP
		vec4 matcapColor = texture2D( matcap, uv );
	#else
		vec4 matcapColor = vec4( vec3( mix( 0.2, 0.8, uv.y ) ), 1.0 );
	#endif
	vec3 outgoingLight = diffuseColor.rgb * matcapColor.rgb;
	#include <opaque_fragment>
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
	#include <fog_fragment>
	#include <premultiplied_alpha_fragment>
	#include <dithering_fragment>
}`,lT=`#define NORMAL
#if defined( FLAT_SHADED ) || defined( USE_BUMPMAP ) || defined( USE_NORMALMAP_TANGENTSPACE )
	varying vec3 vViewPosition;
#endif
#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <displacementmap_pars_vertex>
#include <normal_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
	#include <uv_vertex>
	#include <batching_vertex>
	#include <beginnormal_vertex>
	#include <morphinstance_vertex>
	#include <morphnormal_vertex>
	#include <skinbase_vertex>
	#include <skinnormal_vertex>
	#include <defaultnormal_vertex>
	#include <normal_vertex>
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <skinning_vertex>
	#include <displacementmap_vertex>
	#include <project_vertex>
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
#if defined( FLAT_SHADED ) || defined( USE_BUMPMAP ) || defined( USE_NORMALMAP_TANGENTSPACE )
	vViewPosition = - mvPosition.xyz;
#endif
}`,cT=`#define NORMAL
uniform float opacity;
#if defined( FLAT_SHADED ) || defined( USE_BUMPMAP ) || defined( USE_NORMALMAP_TANGENTSPACE )
	varying vec3 vViewPosition;
#endif
#include <uv_pars_fragment>
#include <normal_pars_fragment>
#include <bumpmap_pars_fragment>
#include <normalmap_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( 0.0, 0.0, 0.0, opacity );
	#include <clipping_planes_fragment>
	#include <logdepthbuf_fragment>
	#include <normal_fragment_begin>
	#include <normal_fragment_maps>
	gl_FragColor = vec4( normalize( normal ) * 0.5 + 0.5, diffuseColor.a );
	#ifdef OPAQUE
		gl_FragColor.a = 1.0;
	#endif
}`,uT=`#define PHONG
varying vec3 vViewPosition;
#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <displacementmap_pars_vertex>
#include <envmap_pars_vertex>
#include <color_pars_vertex>
#include <fog_pars_vertex>
#include <normal_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <shadowmap_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
	#include <uv_vertex>
	#include <color_vertex>
	#include <morphcolor_vertex>
	#include <batching_vertex>
	#include <beginnormal_vertex>
	#include <morphinstance_vertex>
	#include <morphnormal_vertex>
	#include <skinbase_vertex>
	#include <skinnormal_vertex>
	#include <defaultnormal_vertex>
	#include <normal_vertex>
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <skinning_vertex>
	#include <displacementmap_vertex>
	#include <project_vertex>
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
	vViewPosition = - mvPosition.xyz;
	#include <worldpos_vertex>
	#include <envmap_vertex>
	#include <shadowmap_vertex>
	#include <fog_vertex>
}`,hT=`#define PHONG
uniform vec3 diffuse;
uniform vec3 emissive;
uniform vec3 specular;
uniform float shininess;
uniform float opacity;
#include <common>
#include <dithering_pars_fragment>
#include <color_pars_fragment>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <aomap_pars_fragment>
#include <lightmap_pars_fragment>
#include <emissivemap_pars_fragment>
#include <envmap_common_pars_fragment>
#include <envmap_pars_fragment>
#include <envmap_physical_pars_fragment>
#include <fog_pars_fragment>
#include <bsdfs>
#include <lights_pars_begin>
#include <normal_pars_fragment>
#include <lights_phong_pars_fragment>
#include <shadowmap_pars_fragment>
#include <bumpmap_pars_fragment>
#include <normalmap_pars_fragment>
#include <specularmap_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( diffuse, opacity );
	#include <clipping_planes_fragment>
	ReflectedLight reflectedLight = ReflectedLight( vec3( 0.0 ), vec3( 0.0 ), vec3( 0.0 ), vec3( 0.0 ) );
	vec3 totalEmissiveRadiance = emissive;
	#include <logdepthbuf_fragment>
	#include <map_fragment>
	#include <color_fragment>
	#include <alphamap_fragment>
	#include <alphatest_fragment>
	#include <alphahash_fragment>
	#include <specularmap_fragment>
	#include <normal_fragment_begin>
	#include <normal_fragment_maps>
	#include <emissivemap_fragment>
	#include <lights_phong_fragment>
	#include <lights_fragment_begin>
	#include <lights_fragment_maps>
	#include <lights_fragment_end>
	#include <aomap_fragment>
	vec3 outgoingLight = reflectedLight.directDiffuse + reflectedLight.indirectDiffuse + reflectedLight.directSpecular + reflectedLight.indirectSpecular + totalEmissiveRadiance;
	#include <envmap_fragment>
	#include <opaque_fragment>
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
	#include <fog_fragment>
	#include <premultiplied_alpha_fragment>
	#include <dithering_fragment>
}`,dT=`#define STANDARD
varying vec3 vViewPosition;
#ifdef USE_TRANSMISSION
	varying vec3 vWorldPosition;
#endif
#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <displacementmap_pars_vertex>
#include <color_pars_vertex>
#include <fog_pars_vertex>
#include <normal_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <shadowmap_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
	#include <uv_vertex>
	#include <color_vertex>
	#include <morphinstance_vertex>
	#include <morphcolor_vertex>
	#include <batching_vertex>
	#include <beginnormal_vertex>
	#include <morphnormal_vertex>
	#include <skinbase_vertex>
	#include <skinnormal_vertex>
	#include <defaultnormal_vertex>
	#include <normal_vertex>
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <skinning_vertex>
	#include <displacementmap_vertex>
	#include <project_vertex>
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
	vViewPosition = - mvPosition.xyz;
	#include <worldpos_vertex>
	#include <shadowmap_vertex>
	#include <fog_vertex>
#ifdef USE_TRANSMISSION
	vWorldPosition = worldPosition.xyz;
#endif
}`,fT=`#define STANDARD
#ifdef PHYSICAL
	#define IOR
	#define USE_SPECULAR
#endif
uniform vec3 diffuse;
uniform vec3 emissive;
uniform float roughness;
uniform float metalness;
uniform float opacity;
#ifdef IOR
	uniform float ior;
#endif
#ifdef USE_SPECULAR
	uniform float specularIntensity;
	uniform vec3 specularColor;
	#ifdef USE_SPECULAR_COLORMAP
		uniform sampler2D specularColorMap;
	#endif
	#ifdef USE_SPECULAR_INTENSITYMAP
		uniform sampler2D specularIntensityMap;
	#endif
#endif
#ifdef USE_CLEARCOAT
	uniform float clearcoat;
	uniform float clearcoatRoughness;
#endif
#ifdef USE_DIFFUSE_ROUGHNESS
	uniform float diffuseRoughness;
	#ifdef USE_DIFFUSE_ROUGHNESSMAP
		uniform sampler2D diffuseRoughnessMap;
	#endif
#endif
#ifdef USE_DISPERSION
	uniform float dispersion;
#endif
#ifdef USE_RETROREFLECTION
	uniform float retroreflectivity;
#endif
#ifdef USE_IRIDESCENCE
	uniform float iridescence;
	uniform float iridescenceIOR;
	uniform float iridescenceThicknessMinimum;
	uniform float iridescenceThicknessMaximum;
#endif
#ifdef USE_SHEEN
	uniform vec3 sheenColor;
	uniform float sheenRoughness;
	#ifdef USE_SHEEN_COLORMAP
		uniform sampler2D sheenColorMap;
	#endif
	#ifdef USE_SHEEN_ROUGHNESSMAP
		uniform sampler2D sheenRoughnessMap;
	#endif
#endif
#ifdef USE_ANISOTROPY
	uniform vec2 anisotropyVector;
	#ifdef USE_ANISOTROPYMAP
		uniform sampler2D anisotropyMap;
	#endif
#endif
varying vec3 vViewPosition;
#include <common>
#include <dithering_pars_fragment>
#include <color_pars_fragment>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <aomap_pars_fragment>
#include <lightmap_pars_fragment>
#include <emissivemap_pars_fragment>
#include <iridescence_fragment>
#include <envmap_common_pars_fragment>
#include <envmap_physical_pars_fragment>
#include <fog_pars_fragment>
#include <lights_pars_begin>
#include <normal_pars_fragment>
#include <lights_physical_pars_fragment>
#include <transmission_pars_fragment>
#include <shadowmap_pars_fragment>
#include <bumpmap_pars_fragment>
#include <normalmap_pars_fragment>
#include <clearcoat_pars_fragment>
#include <iridescence_pars_fragment>
#include <roughnessmap_pars_fragment>
#include <metalnessmap_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( diffuse, opacity );
	#include <clipping_planes_fragment>
	ReflectedLight reflectedLight = ReflectedLight( vec3( 0.0 ), vec3( 0.0 ), vec3( 0.0 ), vec3( 0.0 ) );
	vec3 totalEmissiveRadiance = emissive;
	#include <logdepthbuf_fragment>
	#include <map_fragment>
	#include <color_fragment>
	#include <alphamap_fragment>
	#include <alphatest_fragment>
	#include <alphahash_fragment>
	#include <roughnessmap_fragment>
	#include <metalnessmap_fragment>
	#include <normal_fragment_begin>
	#include <normal_fragment_maps>
	#include <clearcoat_normal_fragment_begin>
	#include <clearcoat_normal_fragment_maps>
	#include <emissivemap_fragment>
	#include <lights_physical_fragment>
	#include <lights_fragment_begin>
	#include <lights_fragment_maps>
	#include <lights_fragment_end>
	#include <aomap_fragment>
	vec3 totalDiffuse = reflectedLight.directDiffuse + reflectedLight.indirectDiffuse;
	vec3 totalSpecular = reflectedLight.directSpecular + reflectedLight.indirectSpecular;
	#include <transmission_fragment>
	vec3 outgoingLight = totalDiffuse + totalSpecular + totalEmissiveRadiance;
	#ifdef USE_SHEEN
 
		outgoingLight = outgoingLight + sheenSpecularDirect + sheenSpecularIndirect;
 
 	#endif
	#ifdef USE_CLEARCOAT
		float dotNVcc = saturate( dot( geometryClearcoatNormal, geometryViewDir ) );
		vec3 Fcc = F_Schlick( material.clearcoatF0, material.clearcoatF90, dotNVcc );
		outgoingLight = outgoingLight * ( 1.0 - material.clearcoat * Fcc ) + ( clearcoatSpecularDirect + clearcoatSpecularIndirect ) * material.clearcoat;
	#endif
	#include <opaque_fragment>
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
	#include <fog_fragment>
	#include <premultiplied_alpha_fragment>
	#include <dithering_fragment>
}`,pT=`#define TOON
varying vec3 vViewPosition;
#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <displacementmap_pars_vertex>
#include <color_pars_vertex>
#include <fog_pars_vertex>
#include <normal_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <shadowmap_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
	#include <uv_vertex>
	#include <color_vertex>
	#include <morphinstance_vertex>
	#include <morphcolor_vertex>
	#include <batching_vertex>
	#include <beginnormal_vertex>
	#include <morphnormal_vertex>
	#include <skinbase_vertex>
	#include <skinnormal_vertex>
	#include <defaultnormal_vertex>
	#include <normal_vertex>
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <skinning_vertex>
	#include <displacementmap_vertex>
	#include <project_vertex>
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
	vViewPosition = - mvPosition.xyz;
	#include <worldpos_vertex>
	#include <shadowmap_vertex>
	#include <fog_vertex>
}`,mT=`#define TOON
uniform vec3 diffuse;
uniform vec3 emissive;
uniform float opacity;
#include <common>
#include <dithering_pars_fragment>
#include <color_pars_fragment>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <aomap_pars_fragment>
#include <lightmap_pars_fragment>
#include <emissivemap_pars_fragment>
#include <gradientmap_pars_fragment>
#include <fog_pars_fragment>
#include <bsdfs>
#include <lights_pars_begin>
#include <normal_pars_fragment>
#include <lights_toon_pars_fragment>
#include <shadowmap_pars_fragment>
#include <bumpmap_pars_fragment>
#include <normalmap_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( diffuse, opacity );
	#include <clipping_planes_fragment>
	ReflectedLight reflectedLight = ReflectedLight( vec3( 0.0 ), vec3( 0.0 ), vec3( 0.0 ), vec3( 0.0 ) );
	vec3 totalEmissiveRadiance = emissive;
	#include <logdepthbuf_fragment>
	#include <map_fragment>
	#include <color_fragment>
	#include <alphamap_fragment>
	#include <alphatest_fragment>
	#include <alphahash_fragment>
	#include <normal_fragment_begin>
	#include <normal_fragment_maps>
	#include <emissivemap_fragment>
	#include <lights_toon_fragment>
	#include <lights_fragment_begin>
	#include <lights_fragment_maps>
	#include <lights_fragment_end>
	#include <aomap_fragment>
	vec3 outgoingLight = reflectedLight.directDiffuse + reflectedLight.indirectDiffuse + totalEmissiveRadiance;
	#include <opaque_fragment>
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
	#include <fog_fragment>
	#include <premultiplied_alpha_fragment>
	#include <dithering_fragment>
}`,gT=`uniform float size;
uniform float scale;
#include <common>
#include <color_pars_vertex>
#include <fog_pars_vertex>
#include <morphtarget_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
#ifdef USE_POINTS_UV
	varying vec2 vUv;
	uniform mat3 uvTransform;
#endif
void main() {
	#ifdef USE_POINTS_UV
		vUv = ( uvTransform * vec3( uv, 1 ) ).xy;
	#endif
	#include <color_vertex>
	#include <morphinstance_vertex>
	#include <morphcolor_vertex>
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <project_vertex>
	gl_PointSize = size;
	#ifdef USE_SIZEATTENUATION
		bool isPerspective = isPerspectiveMatrix( projectionMatrix );
		if ( isPerspective ) gl_PointSize *= ( scale / - mvPosition.z );
	#endif
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
	#include <worldpos_vertex>
	#include <fog_vertex>
}`,_T=`uniform vec3 diffuse;
uniform float opacity;
#include <common>
#include <color_pars_fragment>
#include <map_particle_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <fog_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( diffuse, opacity );
	#include <clipping_planes_fragment>
	vec3 outgoingLight = vec3( 0.0 );
	#include <logdepthbuf_fragment>
	#include <map_particle_fragment>
	#include <color_fragment>
	#include <alphatest_fragment>
	#include <alphahash_fragment>
	outgoingLight = diffuseColor.rgb;
	#include <opaque_fragment>
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
	#include <fog_fragment>
	#include <premultiplied_alpha_fragment>
}`,vT=`#include <common>
#include <batching_pars_vertex>
#include <fog_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <shadowmap_pars_vertex>
void main() {
	#include <batching_vertex>
	#include <beginnormal_vertex>
	#include <morphinstance_vertex>
	#include <morphnormal_vertex>
	#include <skinbase_vertex>
	#include <skinnormal_vertex>
	#include <defaultnormal_vertex>
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <skinning_vertex>
	#include <project_vertex>
	#include <logdepthbuf_vertex>
	#include <worldpos_vertex>
	#include <shadowmap_vertex>
	#include <fog_vertex>
}`,yT=`uniform vec3 color;
uniform float opacity;
#include <common>
#include <fog_pars_fragment>
#include <bsdfs>
#include <lights_pars_begin>
#include <logdepthbuf_pars_fragment>
#include <shadowmap_pars_fragment>
#include <shadowmask_pars_fragment>
void main() {
	#include <logdepthbuf_fragment>
	gl_FragColor = vec4( color, opacity * ( 1.0 - getShadowMask() ) );
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
	#include <fog_fragment>
	#include <premultiplied_alpha_fragment>
}`,xT=`uniform float rotation;
uniform vec2 center;
#include <common>
#include <uv_pars_vertex>
#include <fog_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
	#include <uv_vertex>
	vec4 mvPosition = modelViewMatrix[ 3 ];
	vec2 scale = vec2( length( modelMatrix[ 0 ].xyz ), length( modelMatrix[ 1 ].xyz ) );
	#ifndef USE_SIZEATTENUATION
		bool isPerspective = isPerspectiveMatrix( projectionMatrix );
		if ( isPerspective ) scale *= - mvPosition.z;
	#endif
	vec2 alignedPosition = ( position.xy - ( center - vec2( 0.5 ) ) ) * scale;
	vec2 rotatedPosition;
	rotatedPosition.x = cos( rotation ) * alignedPosition.x - sin( rotation ) * alignedPosition.y;
	rotatedPosition.y = sin( rotation ) * alignedPosition.x + cos( rotation ) * alignedPosition.y;
	mvPosition.xy += rotatedPosition;
	gl_Position = projectionMatrix * mvPosition;
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
	#include <fog_vertex>
}`,bT=`uniform vec3 diffuse;
uniform float opacity;
#include <common>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <fog_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( diffuse, opacity );
	#include <clipping_planes_fragment>
	vec3 outgoingLight = vec3( 0.0 );
	#include <logdepthbuf_fragment>
	#include <map_fragment>
	#include <alphamap_fragment>
	#include <alphatest_fragment>
	#include <alphahash_fragment>
	outgoingLight = diffuseColor.rgb;
	#include <opaque_fragment>
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
	#include <fog_fragment>
}`,pt={alphahash_fragment:$w,alphahash_pars_fragment:Gw,alphamap_fragment:Ww,alphamap_pars_fragment:Xw,alphatest_fragment:qw,alphatest_pars_fragment:Yw,aomap_fragment:jw,aomap_pars_fragment:Zw,batching_pars_vertex:Jw,batching_vertex:Kw,begin_vertex:Qw,beginnormal_vertex:e1,bsdfs:t1,iridescence_fragment:n1,bumpmap_pars_fragment:i1,clipping_planes_fragment:s1,clipping_planes_pars_fragment:r1,clipping_planes_pars_vertex:o1,clipping_planes_vertex:a1,color_fragment:l1,color_pars_fragment:c1,color_pars_vertex:u1,color_vertex:h1,common:d1,defaultnormal_vertex:f1,displacementmap_pars_vertex:p1,displacementmap_vertex:m1,emissivemap_fragment:g1,emissivemap_pars_fragment:_1,colorspace_fragment:v1,colorspace_pars_fragment:y1,envmap_fragment:x1,envmap_common_pars_fragment:b1,envmap_pars_fragment:S1,envmap_pars_vertex:M1,envmap_physical_pars_fragment:N1,envmap_vertex:w1,fog_vertex:E1,fog_pars_vertex:T1,fog_fragment:A1,fog_pars_fragment:C1,gradientmap_pars_fragment:R1,lightmap_pars_fragment:P1,lights_lambert_fragment:I1,lights_lambert_pars_fragment:L1,lights_pars_begin:D1,lights_toon_fragment:U1,lights_toon_pars_fragment:O1,lights_phong_fragment:F1,lights_phong_pars_fragment:B1,lights_physical_fragment:k1,lights_physical_pars_fragment:z1,lights_fragment_begin:V1,lights_fragment_maps:H1,lights_fragment_end:$1,lightprobes_pars_fragment:G1,logdepthbuf_fragment:W1,logdepthbuf_pars_fragment:X1,logdepthbuf_pars_vertex:q1,logdepthbuf_vertex:Y1,map_fragment:j1,map_pars_fragment:Z1,map_particle_fragment:J1,map_particle_pars_fragment:K1,metalnessmap_fragment:Q1,metalnessmap_pars_fragment:eE,morphinstance_vertex:tE,morphcolor_vertex:nE,morphnormal_vertex:iE,morphtarget_pars_vertex:sE,morphtarget_vertex:rE,normal_fragment_begin:oE,normal_fragment_maps:aE,normal_pars_fragment:lE,normal_pars_vertex:cE,normal_vertex:uE,normalmap_pars_fragment:hE,clearcoat_normal_fragment_begin:dE,clearcoat_normal_fragment_maps:fE,clearcoat_pars_fragment:pE,iridescence_pars_fragment:mE,opaque_fragment:gE,packing:_E,premultiplied_alpha_fragment:vE,project_vertex:yE,dithering_fragment:xE,dithering_pars_fragment:bE,roughnessmap_fragment:SE,roughnessmap_pars_fragment:ME,shadowmap_pars_fragment:wE,shadowmap_pars_vertex:EE,shadowmap_vertex:TE,shadowmask_pars_fragment:AE,skinbase_vertex:CE,skinning_pars_vertex:RE,skinning_vertex:PE,skinnormal_vertex:IE,specularmap_fragment:LE,specularmap_pars_fragment:DE,tonemapping_fragment:NE,tonemapping_pars_fragment:UE,transmission_fragment:OE,transmission_pars_fragment:FE,uv_pars_fragment:BE,uv_pars_vertex:kE,uv_vertex:zE,worldpos_vertex:VE,background_vert:HE,background_frag:$E,backgroundCube_vert:GE,backgroundCube_frag:WE,cube_vert:XE,cube_frag:qE,depth_vert:YE,depth_frag:jE,distance_vert:ZE,distance_frag:JE,equirect_vert:KE,equirect_frag:QE,linedashed_vert:eT,linedashed_frag:tT,meshbasic_vert:nT,meshbasic_frag:iT,meshlambert_vert:sT,meshlambert_frag:rT,meshmatcap_vert:oT,meshmatcap_frag:aT,meshnormal_vert:lT,meshnormal_frag:cT,meshphong_vert:uT,meshphong_frag:hT,meshphysical_vert:dT,meshphysical_frag:fT,meshtoon_vert:pT,meshtoon_frag:mT,points_vert:gT,points_frag:_T,shadow_vert:vT,shadow_frag:yT,sprite_vert:xT,sprite_frag:bT},Ie={common:{diffuse:{value:new lt(16777215)},opacity:{value:1},map:{value:null},mapTransform:{value:new nt},alphaMap:{value:null},alphaMapTransform:{value:new nt},alphaTest:{value:0}},specularmap:{specularMap:{value:null},specularMapTransform:{value:new nt}},envmap:{envMap:{value:null},envMapRotation:{value:new nt},reflectivity:{value:1},ior:{value:1.5},refractionRatio:{value:.98},dfgLUT:{value:null}},aomap:{aoMap:{value:null},aoMapIntensity:{value:1},aoMapTransform:{value:new nt}},lightmap:{lightMap:{value:null},lightMapIntensity:{value:1},lightMapTransform:{value:new nt}},bumpmap:{bumpMap:{value:null},bumpMapTransform:{value:new nt},bumpScale:{value:1}},normalmap:{normalMap:{value:null},normalMapTransform:{value:new nt},normalScale:{value:new at(1,1)}},displacementmap:{displacementMap:{value:null},displacementMapTransform:{value:new nt},displacementScale:{value:1},displacementBias:{value:0}},emissivemap:{emissiveMap:{value:null},emissiveMapTransform:{value:new nt}},metalnessmap:{metalnessMap:{value:null},metalnessMapTransform:{value:new nt}},roughnessmap:{roughnessMap:{value:null},roughnessMapTransform:{value:new nt}},gradientmap:{gradientMap:{value:null}},fog:{fogDensity:{value:25e-5},fogNear:{value:1},fogFar:{value:2e3},fogColor:{value:new lt(16777215)}},lights:{ambientLightColor:{value:[]},lightProbe:{value:[]},sunLights:{value:[],properties:{direction:{},color:{}}},sunLightShadows:{value:[],properties:{shadowIntensity:1,shadowBias:{},shadowNormalBias:{},shadowRadius:{},shadowMapSize:{}}},sunShadowMatrix:{value:[]},sunShadowCascade:{value:[]},directionalLights:{value:[],properties:{direction:{},color:{}}},directionalLightShadows:{value:[],properties:{shadowIntensity:1,shadowBias:{},shadowNormalBias:{},shadowRadius:{},shadowMapSize:{}}},directionalShadowMatrix:{value:[]},spotLights:{value:[],properties:{color:{},position:{},direction:{},distance:{},coneCos:{},penumbraCos:{},decay:{}}},spotLightShadows:{value:[],properties:{shadowIntensity:1,shadowBias:{},shadowNormalBias:{},shadowRadius:{},shadowMapSize:{}}},spotLightMap:{value:[]},spotLightMatrix:{value:[]},pointLights:{value:[],properties:{color:{},position:{},decay:{},distance:{}}},pointLightShadows:{value:[],properties:{shadowIntensity:1,shadowBias:{},shadowNormalBias:{},shadowRadius:{},shadowMapSize:{},shadowCameraNear:{},shadowCameraFar:{}}},pointShadowMatrix:{value:[]},hemisphereLights:{value:[],properties:{direction:{},skyColor:{},groundColor:{}}},rectAreaLights:{value:[],properties:{color:{},position:{},width:{},height:{}}},ltc_1:{value:null},ltc_2:{value:null},probesSH:{value:[]},probesMin:{value:[]},probesMax:{value:[]},probesResolution:{value:[]}},points:{diffuse:{value:new lt(16777215)},opacity:{value:1},size:{value:1},scale:{value:1},map:{value:null},alphaMap:{value:null},alphaMapTransform:{value:new nt},alphaTest:{value:0},uvTransform:{value:new nt}},sprite:{diffuse:{value:new lt(16777215)},opacity:{value:1},center:{value:new at(.5,.5)},rotation:{value:0},map:{value:null},mapTransform:{value:new nt},alphaMap:{value:null},alphaMapTransform:{value:new nt},alphaTest:{value:0}}},Ri={basic:{uniforms:fi([Ie.common,Ie.specularmap,Ie.envmap,Ie.aomap,Ie.lightmap,Ie.fog]),vertexShader:pt.meshbasic_vert,fragmentShader:pt.meshbasic_frag},lambert:{uniforms:fi([Ie.common,Ie.specularmap,Ie.envmap,Ie.aomap,Ie.lightmap,Ie.emissivemap,Ie.bumpmap,Ie.normalmap,Ie.displacementmap,Ie.fog,Ie.lights,{emissive:{value:new lt(0)},envMapIntensity:{value:1}}]),vertexShader:pt.meshlambert_vert,fragmentShader:pt.meshlambert_frag},phong:{uniforms:fi([Ie.common,Ie.specularmap,Ie.envmap,Ie.aomap,Ie.lightmap,Ie.emissivemap,Ie.bumpmap,Ie.normalmap,Ie.displacementmap,Ie.fog,Ie.lights,{emissive:{value:new lt(0)},specular:{value:new lt(1118481)},shininess:{value:30},envMapIntensity:{value:1}}]),vertexShader:pt.meshphong_vert,fragmentShader:pt.meshphong_frag},standard:{uniforms:fi([Ie.common,Ie.envmap,Ie.aomap,Ie.lightmap,Ie.emissivemap,Ie.bumpmap,Ie.normalmap,Ie.displacementmap,Ie.roughnessmap,Ie.metalnessmap,Ie.fog,Ie.lights,{emissive:{value:new lt(0)},roughness:{value:1},metalness:{value:0},envMapIntensity:{value:1}}]),vertexShader:pt.meshphysical_vert,fragmentShader:pt.meshphysical_frag},toon:{uniforms:fi([Ie.common,Ie.aomap,Ie.lightmap,Ie.emissivemap,Ie.bumpmap,Ie.normalmap,Ie.displacementmap,Ie.gradientmap,Ie.fog,Ie.lights,{emissive:{value:new lt(0)}}]),vertexShader:pt.meshtoon_vert,fragmentShader:pt.meshtoon_frag},matcap:{uniforms:fi([Ie.common,Ie.bumpmap,Ie.normalmap,Ie.displacementmap,Ie.fog,{matcap:{value:null}}]),vertexShader:pt.meshmatcap_vert,fragmentShader:pt.meshmatcap_frag},points:{uniforms:fi([Ie.points,Ie.fog]),vertexShader:pt.points_vert,fragmentShader:pt.points_frag},dashed:{uniforms:fi([Ie.common,Ie.fog,{scale:{value:1},dashSize:{value:1},totalSize:{value:2}}]),vertexShader:pt.linedashed_vert,fragmentShader:pt.linedashed_frag},depth:{uniforms:fi([Ie.common,Ie.displacementmap]),vertexShader:pt.depth_vert,fragmentShader:pt.depth_frag},normal:{uniforms:fi([Ie.common,Ie.bumpmap,Ie.normalmap,Ie.displacementmap,{opacity:{value:1}}]),vertexShader:pt.meshnormal_vert,fragmentShader:pt.meshnormal_frag},sprite:{uniforms:fi([Ie.sprite,Ie.fog]),vertexShader:pt.sprite_vert,fragmentShader:pt.sprite_frag},background:{uniforms:{uvTransform:{value:new nt},t2D:{value:null},backgroundIntensity:{value:1}},vertexShader:pt.background_vert,fragmentShader:pt.background_frag},backgroundCube:{uniforms:{envMap:{value:null},backgroundBlurriness:{value:0},backgroundIntensity:{value:1},backgroundRotation:{value:new nt}},vertexShader:pt.backgroundCube_vert,fragmentShader:pt.backgroundCube_frag},cube:{uniforms:{tCube:{value:null},tFlip:{value:-1},opacity:{value:1}},vertexShader:pt.cube_vert,fragmentShader:pt.cube_frag},equirect:{uniforms:{tEquirect:{value:null}},vertexShader:pt.equirect_vert,fragmentShader:pt.equirect_frag},distance:{uniforms:fi([Ie.common,Ie.displacementmap,{referencePosition:{value:new B},nearDistance:{value:1},farDistance:{value:1e3}}]),vertexShader:pt.distance_vert,fragmentShader:pt.distance_frag},shadow:{uniforms:fi([Ie.lights,Ie.fog,{color:{value:new lt(0)},opacity:{value:1}}]),vertexShader:pt.shadow_vert,fragmentShader:pt.shadow_frag}};Ri.physical={uniforms:fi([Ri.standard.uniforms,{clearcoat:{value:0},clearcoatMap:{value:null},clearcoatMapTransform:{value:new nt},clearcoatNormalMap:{value:null},clearcoatNormalMapTransform:{value:new nt},clearcoatNormalScale:{value:new at(1,1)},clearcoatRoughness:{value:0},clearcoatRoughnessMap:{value:null},clearcoatRoughnessMapTransform:{value:new nt},diffuseRoughness:{value:0},diffuseRoughnessMap:{value:null},diffuseRoughnessMapTransform:{value:new nt},dispersion:{value:0},retroreflectivity:{value:0},iridescence:{value:0},iridescenceMap:{value:null},iridescenceMapTransform:{value:new nt},iridescenceIOR:{value:1.3},iridescenceThicknessMinimum:{value:100},iridescenceThicknessMaximum:{value:400},iridescenceThicknessMap:{value:null},iridescenceThicknessMapTransform:{value:new nt},sheen:{value:0},sheenColor:{value:new lt(0)},sheenColorMap:{value:null},sheenColorMapTransform:{value:new nt},sheenRoughness:{value:1},sheenRoughnessMap:{value:null},sheenRoughnessMapTransform:{value:new nt},transmission:{value:0},transmissionMap:{value:null},transmissionMapTransform:{value:new nt},transmissionSamplerSize:{value:new at},transmissionSamplerMap:{value:null},thickness:{value:0},thicknessMap:{value:null},thicknessMapTransform:{value:new nt},attenuationDistance:{value:0},attenuationColor:{value:new lt(0)},specularColor:{value:new lt(1,1,1)},specularColorMap:{value:null},specularColorMapTransform:{value:new nt},specularIntensity:{value:1},specularIntensityMap:{value:null},specularIntensityMapTransform:{value:new nt},anisotropyVector:{value:new at},anisotropyMap:{value:null},anisotropyMapTransform:{value:new nt}}]),vertexShader:pt.meshphysical_vert,fragmentShader:pt.meshphysical_frag};var Ud={r:0,b:0,g:0},ST=new ht,ty=new nt;ty.set(-1,0,0,0,1,0,0,0,1);function MT(n,e,t,i,s,r){let o=new lt(0),a=s===!0?0:1,l,c,u=null,h=0,d=null;function f(x){let T=x.isScene===!0?x.background:null;if(T&&T.isTexture){let b=x.backgroundBlurriness>0;T=e.get(T,b)}return T}function m(x){let T=!1,b=f(x);b===null?g(o,a):b&&b.isColor&&(g(b,1),T=!0);let R=n.xr.getEnvironmentBlendMode();R==="additive"?t.buffers.color.setClear(0,0,0,1,r):R==="alpha-blend"&&t.buffers.color.setClear(0,0,0,0,r),(n.autoClear||T)&&(t.buffers.depth.setTest(!0),t.buffers.depth.setMask(!0),t.buffers.color.setMask(!0),n.clear(n.autoClearColor,n.autoClearDepth,n.autoClearStencil))}function y(x,T){let b=f(T);b&&b.isCubeTexture?(c===void 0&&(c=new Zn(new el(1,1,1),new hi({name:"BackgroundCubeMaterial",uniforms:Xo(Ri.backgroundCube.uniforms),vertexShader:Ri.backgroundCube.vertexShader,fragmentShader:Ri.backgroundCube.fragmentShader,side:Ci,depthTest:!1,depthWrite:!1,fog:!1,allowOverride:!1})),c.geometry.deleteAttribute("normal"),c.geometry.deleteAttribute("uv"),c.onBeforeRender=function(R,A,v){this.matrixWorld.copyPosition(v.matrixWorld)},Object.defineProperty(c.material,"envMap",{get:function(){return this.uniforms.envMap.value}}),i.update(c)),c.material.uniforms.envMap.value=b,c.material.uniforms.backgroundBlurriness.value=T.backgroundBlurriness,c.material.uniforms.backgroundIntensity.value=T.backgroundIntensity,c.material.uniforms.backgroundRotation.value.setFromMatrix4(ST.makeRotationFromEuler(T.backgroundRotation)).transpose(),b.isRenderTargetTexture===!1&&c.material.uniforms.backgroundRotation.value.premultiply(ty),c.material.toneMapped=vt.getTransfer(b.colorSpace)!==Pt,(u!==b||h!==b.version||d!==n.toneMapping)&&(c.material.needsUpdate=!0,u=b,h=b.version,d=n.toneMapping),c.layers.enableAll(),x.unshift(c,c.geometry,c.material,0,0,null)):b&&b.isTexture&&(l===void 0&&(l=new Zn(new Tc(2,2),new hi({name:"BackgroundMaterial",uniforms:Xo(Ri.background.uniforms),vertexShader:Ri.background.vertexShader,fragmentShader:Ri.background.fragmentShader,side:to,depthTest:!1,depthWrite:!1,fog:!1,allowOverride:!1})),l.geometry.deleteAttribute("normal"),Object.defineProperty(l.material,"map",{get:function(){return this.uniforms.t2D.value}}),i.update(l)),l.material.uniforms.t2D.value=b,l.material.uniforms.backgroundIntensity.value=T.backgroundIntensity,l.material.toneMapped=vt.getTransfer(b.colorSpace)!==Pt,b.matrixAutoUpdate===!0&&b.updateMatrix(),l.material.uniforms.uvTransform.value.copy(b.matrix),(u!==b||h!==b.version||d!==n.toneMapping)&&(l.material.needsUpdate=!0,u=b,h=b.version,d=n.toneMapping),l.layers.enableAll(),x.unshift(l,l.geometry,l.material,0,0,null))}function g(x,T){x.getRGB(Ud,Lm(n)),t.buffers.color.setClear(Ud.r,Ud.g,Ud.b,T,r)}function p(){c!==void 0&&(c.geometry.dispose(),c.material.dispose(),c=void 0),l!==void 0&&(l.geometry.dispose(),l.material.dispose(),l=void 0)}return{getClearColor:function(){return o},setClearColor:function(x,T=1){o.set(x),a=T,g(o,a)},getClearAlpha:function(){return a},setClearAlpha:function(x){a=x,g(o,a)},render:m,addToRenderList:y,dispose:p}}function wT(n,e){let t=n.getParameter(n.MAX_VERTEX_ATTRIBS),i={},s=d(null),r=s,o=!1;function a(I,z,H,N,G){let Y=!1,W=h(I,N,H,z);r!==W&&(r=W,c(r.object)),Y=f(I,N,H,G),Y&&m(I,N,H,G),G!==null&&e.update(G,n.ELEMENT_ARRAY_BUFFER),(Y||o)&&(o=!1,b(I,z,H,N),G!==null&&n.bindBuffer(n.ELEMENT_ARRAY_BUFFER,e.get(G).buffer))}function l(){return n.createVertexArray()}function c(I){return n.bindVertexArray(I)}function u(I){return n.deleteVertexArray(I)}function h(I,z,H,N){let G=N.wireframe===!0,Y=i[z.id];Y===void 0&&(Y={},i[z.id]=Y);let W=I.isInstancedMesh===!0?I.id:0,ce=Y[W];ce===void 0&&(ce={},Y[W]=ce);let J=ce[H.id];J===void 0&&(J={},ce[H.id]=J);let Q=J[G];return Q===void 0&&(Q=d(l()),J[G]=Q),Q}function d(I){let z=[],H=[],N=[];for(let G=0;G<t;G++)z[G]=0,H[G]=0,N[G]=0;return{geometry:null,program:null,wireframe:!1,newAttributes:z,enabledAttributes:H,attributeDivisors:N,object:I,attributes:{},index:null}}function f(I,z,H,N){let G=r.attributes,Y=z.attributes,W=0,ce=H.getAttributes();for(let J in ce)if(ce[J].location>=0){let se=G[J],de=Y[J];if(de===void 0&&(J==="instanceMatrix"&&I.instanceMatrix&&(de=I.instanceMatrix),J==="instanceColor"&&I.instanceColor&&(de=I.instanceColor)),se===void 0||se.attribute!==de||de&&se.data!==de.data)return!0;W++}return r.attributesNum!==W||r.index!==N}function m(I,z,H,N){let G={},Y=z.attributes,W=0,ce=H.getAttributes();for(let J in ce)if(ce[J].location>=0){let se=Y[J];se===void 0&&(J==="instanceMatrix"&&I.instanceMatrix&&(se=I.instanceMatrix),J==="instanceColor"&&I.instanceColor&&(se=I.instanceColor));let de={};de.attribute=se,se&&se.data&&(de.data=se.data),G[J]=de,W++}r.attributes=G,r.attributesNum=W,r.index=N}function y(){let I=r.newAttributes;for(let z=0,H=I.length;z<H;z++)I[z]=0}function g(I){p(I,0)}function p(I,z){let H=r.newAttributes,N=r.enabledAttributes,G=r.attributeDivisors;H[I]=1,N[I]===0&&(n.enableVertexAttribArray(I),N[I]=1),G[I]!==z&&(n.vertexAttribDivisor(I,z),G[I]=z)}function x(){let I=r.newAttributes,z=r.enabledAttributes;for(let H=0,N=z.length;H<N;H++)z[H]!==I[H]&&(n.disableVertexAttribArray(H),z[H]=0)}function T(I,z,H,N,G,Y,W){W===!0?n.vertexAttribIPointer(I,z,H,G,Y):n.vertexAttribPointer(I,z,H,N,G,Y)}function b(I,z,H,N){y();let G=N.attributes,Y=H.getAttributes(),W=z.defaultAttributeValues;for(let ce in Y){let J=Y[ce];if(J.location>=0){let Q=G[ce];if(Q===void 0&&(ce==="instanceMatrix"&&I.instanceMatrix&&(Q=I.instanceMatrix),ce==="instanceColor"&&I.instanceColor&&(Q=I.instanceColor)),Q!==void 0){let se=Q.normalized,de=Q.itemSize,he=e.get(Q);if(he===void 0)continue;let ee=he.buffer,ge=he.type,ye=he.bytesPerElement,Ce=ge===n.INT||ge===n.UNSIGNED_INT||Q.gpuType===Zh;if(Q.isInterleavedBufferAttribute){let Me=Q.data,We=Me.isInterleavedBuffer===!0?Me.stride:Me.itemSize,rt=Q.offset;if(Me.isInstancedInterleavedBuffer||Me.isInstancedBufferAttribute){for(let $e=0;$e<J.locationSize;$e++)p(J.location+$e,Me.meshPerAttribute);I.isInstancedMesh!==!0&&N._maxInstanceCount===void 0&&(N._maxInstanceCount=Me.meshPerAttribute*Me.count)}else for(let $e=0;$e<J.locationSize;$e++)g(J.location+$e);n.bindBuffer(n.ARRAY_BUFFER,ee);for(let $e=0;$e<J.locationSize;$e++)T(J.location+$e,de/J.locationSize,ge,se,We*ye,(rt+de/J.locationSize*$e)*ye,Ce)}else{if(Q.isInstancedBufferAttribute){for(let Me=0;Me<J.locationSize;Me++)p(J.location+Me,Q.meshPerAttribute);I.isInstancedMesh!==!0&&N._maxInstanceCount===void 0&&(N._maxInstanceCount=Q.meshPerAttribute*Q.count)}else for(let Me=0;Me<J.locationSize;Me++)g(J.location+Me);n.bindBuffer(n.ARRAY_BUFFER,ee);for(let Me=0;Me<J.locationSize;Me++)T(J.location+Me,de/J.locationSize,ge,se,de*ye,de/J.locationSize*Me*ye,Ce)}}else if(W!==void 0){let se=W[ce];if(se!==void 0)switch(se.length){case 2:n.vertexAttrib2fv(J.location,se);break;case 3:n.vertexAttrib3fv(J.location,se);break;case 4:n.vertexAttrib4fv(J.location,se);break;default:n.vertexAttrib1fv(J.location,se)}}}}x()}function R(){k();for(let I in i){let z=i[I];for(let H in z){let N=z[H];for(let G in N){let Y=N[G];for(let W in Y)u(Y[W].object),delete Y[W];delete N[G]}}delete i[I]}}function A(I){if(i[I.id]===void 0)return;let z=i[I.id];for(let H in z){let N=z[H];for(let G in N){let Y=N[G];for(let W in Y)u(Y[W].object),delete Y[W];delete N[G]}}delete i[I.id]}function v(I){for(let z in i){let H=i[z];for(let N in H){let G=H[N];if(G[I.id]===void 0)continue;let Y=G[I.id];for(let W in Y)u(Y[W].object),delete Y[W];delete G[I.id]}}}function E(I){for(let z in i){let H=i[z],N=I.isInstancedMesh===!0?I.id:0,G=H[N];if(G!==void 0){for(let Y in G){let W=G[Y];for(let ce in W)u(W[ce].object),delete W[ce];delete G[Y]}delete H[N],Object.keys(H).length===0&&delete i[z]}}}function k(){U(),o=!0,r!==s&&(r=s,c(r.object))}function U(){s.geometry=null,s.program=null,s.wireframe=!1}return{setup:a,reset:k,resetDefaultState:U,dispose:R,releaseStatesOfGeometry:A,releaseStatesOfObject:E,releaseStatesOfProgram:v,initAttributes:y,enableAttribute:g,disableUnusedAttributes:x}}function ET(n,e,t){let i;function s(l){i=l}function r(l,c){n.drawArrays(i,l,c),t.update(c,i,1)}function o(l,c,u){u!==0&&(n.drawArraysInstanced(i,l,c,u),t.update(c,i,u))}function a(l,c,u){if(u===0)return;e.get("WEBGL_multi_draw").multiDrawArraysWEBGL(i,l,0,c,0,u);let d=0;for(let f=0;f<u;f++)d+=c[f];t.update(d,i,1)}this.setMode=s,this.render=r,this.renderInstances=o,this.renderMultiDraw=a}function TT(n,e,t,i){let s;function r(){if(s!==void 0)return s;if(e.has("EXT_texture_filter_anisotropic")===!0){let v=e.get("EXT_texture_filter_anisotropic");s=n.getParameter(v.MAX_TEXTURE_MAX_ANISOTROPY_EXT)}else s=0;return s}function o(v){return!(v!==Yi&&i.convert(v)!==n.getParameter(n.IMPLEMENTATION_COLOR_READ_FORMAT))}function a(v){let E=v===As&&(e.has("EXT_color_buffer_half_float")||e.has("EXT_color_buffer_float"));return!(v!==di&&v!==Oi&&!E&&i.convert(v)!==n.getParameter(n.IMPLEMENTATION_COLOR_READ_TYPE))}function l(v){if(v==="highp"){if(n.getShaderPrecisionFormat(n.VERTEX_SHADER,n.HIGH_FLOAT).precision>0&&n.getShaderPrecisionFormat(n.FRAGMENT_SHADER,n.HIGH_FLOAT).precision>0)return"highp";v="mediump"}return v==="mediump"&&n.getShaderPrecisionFormat(n.VERTEX_SHADER,n.MEDIUM_FLOAT).precision>0&&n.getShaderPrecisionFormat(n.FRAGMENT_SHADER,n.MEDIUM_FLOAT).precision>0?"mediump":"lowp"}let c=t.precision!==void 0?t.precision:"highp",u=l(c);u!==c&&(Ze("WebGLRenderer:",c,"not supported, using",u,"instead."),c=u);let h=t.reversedDepthBuffer===!0&&e.has("EXT_clip_control"),d=t.logarithmicDepthBuffer===!0&&h===!1;t.reversedDepthBuffer===!0&&h===!1&&Ze("WebGLRenderer: Unable to use reversed depth buffer due to missing EXT_clip_control extension. Fallback to default depth buffer."),t.logarithmicDepthBuffer===!0&&h===!0&&Ze("WebGLRenderer: Logarithmic depth buffer is ignored when reversed depth buffer is enabled.");let f=n.getParameter(n.MAX_TEXTURE_IMAGE_UNITS),m=n.getParameter(n.MAX_VERTEX_TEXTURE_IMAGE_UNITS),y=n.getParameter(n.MAX_TEXTURE_SIZE),g=n.getParameter(n.MAX_CUBE_MAP_TEXTURE_SIZE),p=n.getParameter(n.MAX_VERTEX_ATTRIBS),x=n.getParameter(n.MAX_VERTEX_UNIFORM_VECTORS),T=n.getParameter(n.MAX_VARYING_VECTORS),b=n.getParameter(n.MAX_FRAGMENT_UNIFORM_VECTORS),R=n.getParameter(n.MAX_SAMPLES),A=n.getParameter(n.SAMPLES);return{isWebGL2:!0,getMaxAnisotropy:r,getMaxPrecision:l,textureFormatReadable:o,textureTypeReadable:a,precision:c,logarithmicDepthBuffer:d,reversedDepthBuffer:h,maxTextures:f,maxVertexTextures:m,maxTextureSize:y,maxCubemapSize:g,maxAttributes:p,maxVertexUniforms:x,maxVaryings:T,maxFragmentUniforms:b,maxSamples:R,samples:A}}function AT(n){let e=this,t=null,i=0,s=!1,r=!1,o=new Ms,a=new nt,l={value:null,needsUpdate:!1};this.uniform=l,this.numPlanes=0,this.numIntersection=0,this.init=function(h,d){let f=h.length!==0||d||i!==0||s;return s=d,i=h.length,f},this.beginShadows=function(){r=!0,u(null)},this.endShadows=function(){r=!1},this.setGlobalState=function(h,d){t=u(h,d,0)},this.setState=function(h,d,f){let m=h.clippingPlanes,y=h.clipIntersection,g=h.clipShadows,p=n.get(h);if(!s||m===null||m.length===0||r&&!g)r?u(null):c();else{let x=r?0:i,T=x*4,b=p.clippingState||null;l.value=b,b=u(m,d,T,f);for(let R=0;R!==T;++R)b[R]=t[R];p.clippingState=b,this.numIntersection=y?this.numPlanes:0,this.numPlanes+=x}};function c(){l.value!==t&&(l.value=t,l.needsUpdate=i>0),e.numPlanes=i,e.numIntersection=0}function u(h,d,f,m){let y=h!==null?h.length:0,g=null;if(y!==0){if(g=l.value,m!==!0||g===null){let p=f+y*4,x=d.matrixWorldInverse;a.getNormalMatrix(x),(g===null||g.length<p)&&(g=new Float32Array(p));for(let T=0,b=f;T!==y;++T,b+=4)o.copy(h[T]).applyMatrix4(x,a),o.normal.toArray(g,b),g[b+3]=o.constant}l.value=g,l.needsUpdate=!0}return e.numPlanes=y,e.numIntersection=0,g}}var qc=class extends Ai{constructor(e=1,t={}){super(e,e,t),this.isWebGLCubeRenderTarget=!0;let i={width:e,height:e,depth:1},s=[i,i,i,i,i,i];this.texture=new Sc(s),this._setTextureOptions(t),this.texture.isRenderTargetTexture=!0}fromEquirectangularTexture(e,t){this.texture.type=t.type,this.texture.colorSpace=t.colorSpace,this.texture.generateMipmaps=t.generateMipmaps,this.texture.minFilter=t.minFilter,this.texture.magFilter=t.magFilter;let i={uniforms:{tEquirect:{value:null}},vertexShader:`

				varying vec3 vWorldDirection;

				vec3 transformDirection( in vec3 dir, in mat4 matrix ) {

					return normalize( ( matrix * vec4( dir, 0.0 ) ).xyz );

				}

				void main() {

					vWorldDirection = transformDirection( position, modelMatrix );

					#include <begin_vertex>
					#include <project_vertex>

				}
			`,fragmentShader:`

				uniform sampler2D tEquirect;

				varying vec3 vWorldDirection;

				#include <common>

				void main() {

					vec3 direction = normalize( vWorldDirection );

					vec2 sampleUV = equirectUv( direction );

					gl_FragColor = texture2D( tEquirect, sampleUV );

				}
			`},s=new el(5,5,5),r=new hi({name:"CubemapFromEquirect",uniforms:Xo(i.uniforms),vertexShader:i.vertexShader,fragmentShader:i.fragmentShader,side:Ci,blending:Vo});r.uniforms.tEquirect.value=t;let o=new Zn(s,r),a=t.minFilter;return t.minFilter===br&&(t.minFilter=Ti),new tl(1,10,this).update(e,o),t.minFilter=a,o.geometry.dispose(),o.material.dispose(),this}clear(e,t=!0,i=!0,s=!0){let r=e.getRenderTarget();for(let o=0;o<6;o++)e.setRenderTarget(this,o),e.clear(t,i,s);e.setRenderTarget(r)}},Dv=256,CT=3,RT=20,ny=256,iy=16,PT=3,IT=new B,LT=new lt,Fd=class n{constructor(e){this._renderer=e,this._cubeSize=0,this._sourceTarget=null,this._cubeCamera=new tl(1,10,null),this._boxMesh=new Zn(new el(5,5,5),null),this._cubemapMaterial=null,this._equirectMaterial=null,this._blurMaterial=null,this._ggxMaterial=null,this._integrationMaterial=null}fromScene(e,t=0,i=.1,s=100,r={}){let{size:o=256,position:a=IT}=r,l=this._renderer;this._setSize(o);let c=this._allocateTarget(),u=this._getSourceTarget(!0);t>0&&(u.texture.mipmapsAutoUpdate=!1);let h=l.autoClear,d=l.autoClearColor,f=l.autoClearDepth,m=l.autoClearStencil,y=e.background;l.autoClear=!0,l.autoClearColor=!0,l.autoClearDepth=!0,l.autoClearStencil=!0,y===null&&(e.background=l.getClearColor(LT));let g=new tl(i,s,u);return g.position.copy(a),g.update(l,e),l.autoClear=h,l.autoClearColor=d,l.autoClearDepth=f,l.autoClearStencil=m,e.background=y,t>0&&(u.texture.mipmapsAutoUpdate=!0,this._blur(c,t)),this._applyPMREM(c),c}fromEquirectangular(e,t=null){return this._fromTexture(e,t)}fromCubemap(e,t=null){return this._fromTexture(e,t)}compileCubemapShader(){this._cubemapMaterial===null&&(this._cubemapMaterial=Ov(),this._compileMaterial(this._cubemapMaterial))}compileEquirectangularShader(){this._equirectMaterial===null&&(this._equirectMaterial=Uv(),this._compileMaterial(this._equirectMaterial))}dispose(){this._sourceTarget!==null&&this._sourceTarget.dispose(),this._cubemapMaterial!==null&&this._cubemapMaterial.dispose(),this._equirectMaterial!==null&&this._equirectMaterial.dispose(),this._blurMaterial!==null&&this._blurMaterial.dispose(),this._ggxMaterial!==null&&this._ggxMaterial.dispose(),this._integrationMaterial!==null&&this._integrationMaterial.dispose(),this._boxMesh.geometry.dispose()}static lodToRoughness(e,t){return t>0?1-Math.sqrt(1-e/t):0}_setSize(e){this._cubeSize=Math.max(Dv,Cm(e))}_fromTexture(e,t){e.mapping===$o||e.mapping===sl?this._setSize(e.image.length===0?Dv:e.image[0].width||e.image[0].image.width):this._setSize(e.image.width/4);let i=t||this._allocateTarget();return this._textureToCubemap(e),this._applyPMREM(i),i}_allocateTarget(){let e=this._cubeSize,t=Nv(e,!1,!1),i=Math.log2(e)-CT;for(let s=0;s<=i;s++)t.texture.mipmaps.push({width:e>>s,height:e>>s});return t.texture.name="PMREM",t.texture.isPMREMTexture=!0,t}_getSourceTarget(e=!1){let t=this._cubeSize,i=this._sourceTarget;return(i===null||i.width!==t||e&&i.depthBuffer===!1)&&(i!==null&&i.dispose(),this._sourceTarget=Nv(t,!0,e)),this._sourceTarget}_compileMaterial(e){this._boxMesh.material=e,this._renderer.compile(this._boxMesh,this._cubeCamera.children[0])}_renderCube(e,t,i){let s=this._boxMesh,r=this._cubeCamera;s.material=i,r.renderTarget=e,r.activeMipmapLevel=t;let o=e.width>>t;e.viewport.set(0,0,o,o),r.update(this._renderer,s),e.viewport.set(0,0,e.width,e.height)}_textureToCubemap(e){let t;e.mapping===$o||e.mapping===sl?(this._cubemapMaterial===null&&(this._cubemapMaterial=Ov()),t=this._cubemapMaterial,t.uniforms.flipEnvMap.value=e.isRenderTargetTexture===!1?-1:1):(this._equirectMaterial===null&&(this._equirectMaterial=Uv()),t=this._equirectMaterial),t.uniforms.envMap.value=e,this._renderCube(this._getSourceTarget(),0,t)}_applyPMREM(e){this._ggxMaterial===null&&(this._ggxMaterial=DT(),this._integrationMaterial=NT());let t=this._cubeSize,i=e.texture.mipmaps.length-1,s=this._ggxMaterial.uniforms;s.envMap.value=this._sourceTarget.texture;let r=this._integrationMaterial.uniforms;r.envMap.value=this._sourceTarget.texture,r.sourceLod.value=Math.log2(t/iy);for(let o=0;o<=i;o++){let a=n.lodToRoughness(o,i);if(o>i-PT)r.roughness.value=a,this._renderCube(e,o,this._integrationMaterial);else{let l=a>0?Math.log2(t)+.5*Math.log2(6/(ny*Math.pow(a,4)))+.5:0;s.roughness.value=a,s.lodBias.value=l,this._renderCube(e,o,this._ggxMaterial)}}}_blur(e,t){this._blurMaterial===null&&(this._blurMaterial=UT());let i=this._blurMaterial,s=i.uniforms,r=this._sourceTarget;s.sigma.value=Math.min(t,Math.PI)/Math.SQRT2,s.envMap.value=r.texture,this._renderCube(e,0,i),s.envMap.value=e.texture,this._renderCube(r,0,i)}};function Nv(n,e,t){return new qc(n,{minFilter:br,generateMipmaps:e,type:As,colorSpace:Oo,depthBuffer:t})}function Yc(n,e,t){return new hi({name:n,uniforms:e,vertexShader:pt.cube_vert,fragmentShader:t,side:Ci,blending:Vo,depthTest:!1,depthWrite:!1})}function DT(){return Yc("PMREMGGXConvolution",{envMap:{value:null},roughness:{value:0},lodBias:{value:0}},`

		#define GGX_SAMPLES ${ny}u

		varying vec3 vWorldDirection;

		uniform samplerCube envMap;
		uniform float roughness;
		uniform float lodBias;

		#include <common>

		// Van der Corput radical inverse
		float radicalInverse_VdC( uint bits ) {

			bits = ( bits << 16u ) | ( bits >> 16u );
			bits = ( ( bits & 0x55555555u ) << 1u ) | ( ( bits & 0xAAAAAAAAu ) >> 1u );
			bits = ( ( bits & 0x33333333u ) << 2u ) | ( ( bits & 0xCCCCCCCCu ) >> 2u );
			bits = ( ( bits & 0x0F0F0F0Fu ) << 4u ) | ( ( bits & 0xF0F0F0F0u ) >> 4u );
			bits = ( ( bits & 0x00FF00FFu ) << 8u ) | ( ( bits & 0xFF00FF00u ) >> 8u );
			return float( bits ) * 2.3283064365386963e-10; // / 0x100000000

		}

		// Hammersley sequence
		vec2 hammersley( uint i, uint N ) {

			return vec2( float( i ) / float( N ), radicalInverse_VdC( i ) );

		}

		void main() {

			vec3 N = normalize( vWorldDirection );

			// For very low roughness, just sample the environment directly
			if ( roughness < 0.001 ) {

				gl_FragColor = vec4( textureLod( envMap, N, 0.0 ).rgb, 1.0 );
				return;

			}

			float alpha = roughness * roughness;
			float alpha2 = alpha * alpha;

			// Tangent space basis for VNDF sampling
			vec3 up = abs( N.z ) < 0.999 ? vec3( 0.0, 0.0, 1.0 ) : vec3( 1.0, 0.0, 0.0 );
			vec3 tangent = normalize( cross( up, N ) );
			vec3 bitangent = cross( N, tangent );

			vec3 prefilteredColor = vec3( 0.0 );
			float totalWeight = 0.0;

			for ( uint i = 0u; i < GGX_SAMPLES; i ++ ) {

				vec2 Xi = hammersley( i, GGX_SAMPLES );

				// With V = N, sample the reflected direction directly.
				float invQ = 1.0 / ( 1.0 - Xi.x + alpha2 * Xi.x );
				float NdotL = ( 1.0 - Xi.x - alpha2 * Xi.x ) * invQ;

				if ( NdotL > 0.0 ) {

					float phi = 2.0 * PI * Xi.y;
					float sinTheta = 2.0 * alpha * sqrt( Xi.x * ( 1.0 - Xi.x ) ) * invQ;
					vec3 L = N * NdotL + ( tangent * cos( phi ) + bitangent * sin( phi ) ) * sinTheta;

					// Match the source mip to the sample's solid angle. The terms
					// independent of the sample are precomputed in lodBias.
					float d = alpha2 * invQ;
					float lod = max( log2( d ) + lodBias, 0.0 );

					// Weight by NdotL for the split-sum approximation
					prefilteredColor += textureLod( envMap, L, lod ).rgb * NdotL;
					totalWeight += NdotL;

				}

			}

			gl_FragColor = vec4( prefilteredColor / totalWeight, 1.0 );

		}
	`)}function NT(){return Yc("PMREMGGXIntegration",{envMap:{value:null},roughness:{value:0},sourceLod:{value:0},sourceSize:{value:iy}},`

		varying vec3 vWorldDirection;

		uniform samplerCube envMap;
		uniform float roughness;
		uniform float sourceLod;
		uniform int sourceSize;

		void main() {

			vec3 N = normalize( vWorldDirection );

			float alpha = roughness * roughness;
			float alpha2 = alpha * alpha;

			float texelSize = 2.0 / float( sourceSize );

			vec3 prefilteredColor = vec3( 0.0 );
			float totalWeight = 0.0;

			// Pair opposite texels: only the one in N's hemisphere contributes.
			for ( int face = 0; face < 3; face ++ ) {

				for ( int y = 0; y < sourceSize; y ++ ) {

					for ( int x = 0; x < sourceSize; x ++ ) {

						vec2 uv = ( vec2( x, y ) + 0.5 ) * texelSize - 1.0;
						vec3 texelDirection = face == 0 ? vec3( 1.0, uv ) : ( face == 1 ? vec3( uv.x, 1.0, uv.y ) : vec3( uv, 1.0 ) );

						float invDistance = inversesqrt( 1.0 + dot( uv, uv ) );
						float NdotL = dot( N, texelDirection );
						texelDirection *= NdotL < 0.0 ? - 1.0 : 1.0;
						NdotL = abs( NdotL ) * invDistance;

						// With V = N, NdotH squared is ( 1 + NdotL ) / 2. Common factors
						// in the GGX distribution and texel solid angle cancel when normalized.
						float d = 1.0 + alpha2 + ( alpha2 - 1.0 ) * NdotL;
						float weight = NdotL * invDistance * invDistance * invDistance / ( d * d );

						prefilteredColor += textureLod( envMap, texelDirection, sourceLod ).rgb * weight;
						totalWeight += weight;

					}

				}

			}

			gl_FragColor = vec4( prefilteredColor / totalWeight, 1.0 );

		}
	`)}function UT(){return Yc("PMREMSphericalGaussianBlur",{envMap:{value:null},sigma:{value:0}},`

		#define SAMPLES ${RT}
		#define GOLDEN_ANGLE 2.39996322973

		varying vec3 vWorldDirection;

		uniform samplerCube envMap;
		uniform float sigma;

		#include <common>

		void main() {

			vec3 outputDirection = normalize( vWorldDirection );

			vec3 up = abs( outputDirection.z ) < 0.999 ? vec3( 0.0, 0.0, 1.0 ) : vec3( 1.0, 0.0, 0.0 );
			vec3 tangent = normalize( cross( up, outputDirection ) );
			vec3 bitangent = cross( outputDirection, tangent );

			// Truncate the kernel at three standard deviations or at the antipode.
			float thetaMax = min( 3.0 * sigma, PI );
			float truncation = 1.0 - exp( - 0.5 * thetaMax * thetaMax / ( sigma * sigma ) );

			vec3 accumColor = vec3( 0.0 );
			float accumWeight = 0.0;

			for ( int i = 0; i < SAMPLES; i ++ ) {

				// Stratified inverse-CDF sampling of the Gaussian, placed on a golden-angle spiral.
				float stratum = ( float( i ) + 0.5 ) / float( SAMPLES );
				float theta = sigma * sqrt( - 2.0 * log( 1.0 - stratum * truncation ) );
				float phi = float( i ) * GOLDEN_ANGLE;

				vec3 offset = cos( phi ) * tangent + sin( phi ) * bitangent;
				vec3 sampleDirection = cos( theta ) * outputDirection + sin( theta ) * offset;

				// Correct the planar sample density to solid angle.
				float weight = sin( theta ) / theta;

				accumColor += weight * textureLod( envMap, sampleDirection, 0.0 ).rgb;
				accumWeight += weight;

			}

			gl_FragColor = vec4( accumColor / accumWeight, 1.0 );

		}
	`)}function Uv(){return Yc("PMREMEquirectangularToCubemap",{envMap:{value:null}},`

		varying vec3 vWorldDirection;

		uniform sampler2D envMap;

		#include <common>

		void main() {

			// Average four subpixel samples to preserve small, bright features.
			vec3 direction = normalize( vWorldDirection );
			vec3 dx = dFdx( direction ) * 0.25;
			vec3 dy = dFdy( direction ) * 0.25;

			vec3 color = textureLod( envMap, equirectUv( normalize( direction - dx - dy ) ), 0.0 ).rgb;
			color += textureLod( envMap, equirectUv( normalize( direction + dx - dy ) ), 0.0 ).rgb;
			color += textureLod( envMap, equirectUv( normalize( direction - dx + dy ) ), 0.0 ).rgb;
			color += textureLod( envMap, equirectUv( normalize( direction + dx + dy ) ), 0.0 ).rgb;
			gl_FragColor = vec4( color * 0.25, 1.0 );

		}
	`)}function Ov(){return Yc("PMREMCubemapToCubemap",{envMap:{value:null},flipEnvMap:{value:-1}},`

		varying vec3 vWorldDirection;

		uniform samplerCube envMap;
		uniform float flipEnvMap;

		void main() {

			gl_FragColor = vec4( textureCube( envMap, vec3( flipEnvMap * vWorldDirection.x, vWorldDirection.yz ) ).rgb, 1.0 );

		}
	`)}function OT(n){let e=new WeakMap,t=new WeakMap,i=null;function s(d,f=!1){return d==null?null:f?o(d):r(d)}function r(d){if(d&&d.isTexture){let f=d.mapping;if(f===qh||f===Yh)if(e.has(d)){let m=e.get(d).texture;return a(m,d.mapping)}else{let m=d.image;if(m&&m.height>0){let y=new qc(m.height);return y.fromEquirectangularTexture(n,d),e.set(d,y),d.addEventListener("dispose",c),a(y.texture,d.mapping)}else return null}}return d}function o(d){if(d&&d.isTexture&&d.isPMREMTexture!==!0){let f=d.mapping,m=f===qh||f===Yh,y=f===$o||f===sl;if(m||y){let g=t.get(d),p=g!==void 0?g.texture.pmremVersion:0;if(d.isRenderTargetTexture&&d.pmremVersion!==p)return i===null&&(i=new Fd(n)),g=m?i.fromEquirectangular(d,g):i.fromCubemap(d,g),g.texture.pmremVersion=d.pmremVersion,t.set(d,g),g.texture;if(g!==void 0)return g.texture;{let x=d.image;return m&&x&&x.height>0||y&&x&&l(x)?(i===null&&(i=new Fd(n)),g=m?i.fromEquirectangular(d):i.fromCubemap(d),g.texture.pmremVersion=d.pmremVersion,t.set(d,g),d.addEventListener("dispose",u),g.texture):null}}}return d}function a(d,f){return f===qh?d.mapping=$o:f===Yh&&(d.mapping=sl),d}function l(d){let f=0,m=6;for(let y=0;y<m;y++)d[y]!==void 0&&f++;return f===m}function c(d){let f=d.target;f.removeEventListener("dispose",c);let m=e.get(f);m!==void 0&&(e.delete(f),m.dispose())}function u(d){let f=d.target;f.removeEventListener("dispose",u);let m=t.get(f);m!==void 0&&(t.delete(f),m.dispose())}function h(){e=new WeakMap,t=new WeakMap,i!==null&&(i.dispose(),i=null)}return{get:s,dispose:h}}function FT(n){let e={};function t(i){if(e[i]!==void 0)return e[i];let s=n.getExtension(i);return e[i]=s,s}return{has:function(i){return t(i)!==null},init:function(){t("EXT_color_buffer_float"),t("WEBGL_clip_cull_distance"),t("OES_texture_float_linear"),t("EXT_color_buffer_half_float"),t("WEBGL_multisampled_render_to_texture"),t("WEBGL_render_shared_exponent")},get:function(i){let s=t(i);return s===null&&lc("WebGLRenderer: "+i+" extension not supported."),s}}}function BT(n,e,t,i){let s={},r=new WeakMap,o=new FinalizationRegistry(m=>delete s[m]);function a(m){l(m.target)}function l(m){m.index!==null&&e.remove(m.index);for(let g in m.attributes)e.remove(m.attributes[g]);m.removeEventListener("dispose",a),delete s[m.id],o.unregister(m);let y=r.get(m);y&&(e.remove(y),r.delete(m)),i.releaseStatesOfGeometry(m),m.isInstancedBufferGeometry===!0&&delete m._maxInstanceCount,t.memory.geometries--}function c(m,y){return s[y.id]!==void 0||(y.addEventListener("dispose",a),s[y.id]=new WeakRef(y),o.register(y,y.id,y),t.memory.geometries++),y}function u(m){let y=m.attributes;for(let g in y)e.update(y[g],n.ARRAY_BUFFER)}function h(m){let y=m.index,g=m.attributes.position,p=0;if(g===void 0)return;let x=y!==null?y.array.length:g.array.length/3-1,T=g.count>=65535?vc:_c,b=new T(Math.ceil(x/3)*6,1),R=b.array;if(y!==null){let v=y.array;p=y.version;for(let E=0,k=0;E<x;E+=3){let U=v[E+0],I=v[E+1],z=v[E+2];R[k++]=U,R[k++]=I,R[k++]=I,R[k++]=z,R[k++]=z,R[k++]=U}}else{p=g.version;for(let v=0,E=0;v<x;v+=3){let k=v+0,U=v+1,I=v+2;R[E++]=k,R[E++]=U,R[E++]=U,R[E++]=I,R[E++]=I,R[E++]=k}}b.version=p;let A=r.get(m);A&&e.remove(A),r.set(m,b)}function d(m){let y=r.get(m);if(y){let g=m.index;g!==null&&y.version<g.version&&h(m)}else h(m);return r.get(m)}function f(){for(let m in s){let y=s[m].deref();y!==void 0&&l(y)}}return{get:c,update:u,getWireframeAttribute:d,dispose:f}}function kT(n,e,t){let i;function s(h){i=h}let r,o;function a(h){r=h.type,o=h.bytesPerElement}function l(h,d){n.drawElements(i,d,r,h*o),t.update(d,i,1)}function c(h,d,f){f!==0&&(n.drawElementsInstanced(i,d,r,h*o,f),t.update(d,i,f))}function u(h,d,f){if(f===0)return;e.get("WEBGL_multi_draw").multiDrawElementsWEBGL(i,d,0,r,h,0,f);let y=0;for(let g=0;g<f;g++)y+=d[g];t.update(y,i,1)}this.setMode=s,this.setIndex=a,this.render=l,this.renderInstances=c,this.renderMultiDraw=u}function zT(n){let e={geometries:0,textures:0},t={frame:0,calls:0,triangles:0,points:0,lines:0};function i(r,o,a){switch(t.calls++,o){case n.TRIANGLES:t.triangles+=a*(r/3);break;case n.LINES:t.lines+=a*(r/2);break;case n.LINE_STRIP:t.lines+=a*(r-1);break;case n.LINE_LOOP:t.lines+=a*r;break;case n.POINTS:t.points+=a*r;break;default:tt("WebGLInfo: Unknown draw mode:",o);break}}function s(){t.calls=0,t.triangles=0,t.points=0,t.lines=0}return{memory:e,render:t,programs:null,autoReset:!0,reset:s,update:i}}function VT(n,e,t){let i=new WeakMap,s=new It;function r(o,a,l){let c=o.morphTargetInfluences,u=a.morphAttributes.position||a.morphAttributes.normal||a.morphAttributes.color,h=u!==void 0?u.length:0,d=i.get(a);if(d===void 0||d.count!==h){let k=function(){v.dispose(),i.delete(a),a.removeEventListener("dispose",k)};d!==void 0&&d.texture.dispose();let f=a.morphAttributes.position!==void 0,m=a.morphAttributes.normal!==void 0,y=a.morphAttributes.color!==void 0,g=a.morphAttributes.position||[],p=a.morphAttributes.normal||[],x=a.morphAttributes.color||[],T=0;f===!0&&(T=1),m===!0&&(T=2),y===!0&&(T=3);let b=a.attributes.position.count*T,R=1;b>e.maxTextureSize&&(R=Math.ceil(b/e.maxTextureSize),b=e.maxTextureSize);let A=new Float32Array(b*R*4*h),v=new mc(A,b,R,h);v.type=Oi,v.needsUpdate=!0;let E=T*4;for(let U=0;U<h;U++){let I=g[U],z=p[U],H=x[U],N=b*R*4*U;for(let G=0;G<I.count;G++){let Y=G*E;f===!0&&(s.fromBufferAttribute(I,G),A[N+Y+0]=s.x,A[N+Y+1]=s.y,A[N+Y+2]=s.z,A[N+Y+3]=0),m===!0&&(s.fromBufferAttribute(z,G),A[N+Y+4]=s.x,A[N+Y+5]=s.y,A[N+Y+6]=s.z,A[N+Y+7]=0),y===!0&&(s.fromBufferAttribute(H,G),A[N+Y+8]=s.x,A[N+Y+9]=s.y,A[N+Y+10]=s.z,A[N+Y+11]=H.itemSize===4?s.w:1)}}d={count:h,texture:v,size:new at(b,R)},i.set(a,d),a.addEventListener("dispose",k)}if(o.isInstancedMesh===!0&&o.morphTexture!==null)l.getUniforms().setValue(n,"morphTexture",o.morphTexture,t);else{let f=0;for(let y=0;y<c.length;y++)f+=c[y];let m=a.morphTargetsRelative?1:1-f;l.getUniforms().setValue(n,"morphTargetBaseInfluence",m),l.getUniforms().setValue(n,"morphTargetInfluences",c)}l.getUniforms().setValue(n,"morphTargetsTexture",d.texture,t),l.getUniforms().setValue(n,"morphTargetsTextureSize",d.size)}return{update:r}}function HT(n,e,t,i,s){let r=new WeakMap;function o(c){let u=s.render.frame,h=c.geometry,d=e.get(c,h);if(r.get(d)!==u&&(e.update(d),r.set(d,u)),c.isInstancedMesh&&(c.hasEventListener("dispose",l)===!1&&c.addEventListener("dispose",l),r.get(c)!==u&&(t.update(c.instanceMatrix,n.ARRAY_BUFFER),c.instanceColor!==null&&t.update(c.instanceColor,n.ARRAY_BUFFER),r.set(c,u))),c.isSkinnedMesh){let f=c.skeleton;r.get(f)!==u&&(f.update(),r.set(f,u))}return d}function a(){r=new WeakMap}function l(c){let u=c.target;u.removeEventListener("dispose",l),i.releaseStatesOfObject(u),t.remove(u.instanceMatrix),u.instanceColor!==null&&t.remove(u.instanceColor)}return{update:o,dispose:a}}var $T={[cm]:"LINEAR_TONE_MAPPING",[um]:"REINHARD_TONE_MAPPING",[hm]:"CINEON_TONE_MAPPING",[dm]:"ACES_FILMIC_TONE_MAPPING",[pm]:"AGX_TONE_MAPPING",[mm]:"NEUTRAL_TONE_MAPPING",[fm]:"CUSTOM_TONE_MAPPING"};function GT(n,e,t,i,s,r){let o=new Ai(e,t,{type:n,depthBuffer:s,stencilBuffer:r,samples:i?4:0,storeMultisampledDepthBuffer:!1,storeMultisampledStencilBuffer:!1,resolveDepthBuffer:!1,resolveStencilBuffer:!1}),a=null,l=null,c=null,u=new Bn;u.setAttribute("position",new pn([-1,3,0,-1,-1,0,3,-1,0],3)),u.setAttribute("uv",new pn([0,2,0,0,2,0],2));let h=new Ih({uniforms:{tDiffuse:{value:null}},vertexShader:`
			precision highp float;

			uniform mat4 modelViewMatrix;
			uniform mat4 projectionMatrix;

			attribute vec3 position;
			attribute vec2 uv;

			varying vec2 vUv;

			void main() {
				vUv = uv;
				gl_Position = projectionMatrix * modelViewMatrix * vec4( position, 1.0 );
			}`,fragmentShader:`
			precision highp float;

			uniform sampler2D tDiffuse;

			varying vec2 vUv;

			#include <tonemapping_pars_fragment>
			#include <colorspace_pars_fragment>

			void main() {
				gl_FragColor = texture2D( tDiffuse, vUv );

				#ifdef LINEAR_TONE_MAPPING
					gl_FragColor.rgb = LinearToneMapping( gl_FragColor.rgb );
				#elif defined( REINHARD_TONE_MAPPING )
					gl_FragColor.rgb = ReinhardToneMapping( gl_FragColor.rgb );
				#elif defined( CINEON_TONE_MAPPING )
					gl_FragColor.rgb = CineonToneMapping( gl_FragColor.rgb );
				#elif defined( ACES_FILMIC_TONE_MAPPING )
					gl_FragColor.rgb = ACESFilmicToneMapping( gl_FragColor.rgb );
				#elif defined( AGX_TONE_MAPPING )
					gl_FragColor.rgb = AgXToneMapping( gl_FragColor.rgb );
				#elif defined( NEUTRAL_TONE_MAPPING )
					gl_FragColor.rgb = NeutralToneMapping( gl_FragColor.rgb );
				#elif defined( CUSTOM_TONE_MAPPING )
					gl_FragColor.rgb = CustomToneMapping( gl_FragColor.rgb );
				#endif

				#ifdef SRGB_TRANSFER
					gl_FragColor = sRGBTransferOETF( gl_FragColor );
				#endif
			}`,depthTest:!1,depthWrite:!1}),d=new Zn(u,h),f=new zo(-1,1,1,-1,0,1),m=null,y=null,g=!1,p,x=null,T=[],b=!1;this.setSize=function(R,A){o.setSize(R,A),a!==null&&a.setSize(R,A),l!==null&&l.setSize(R,A);for(let v=0;v<T.length;v++){let E=T[v];E.setSize&&E.setSize(R,A)}},this.setEffects=function(R){T=R,b=T.length>0&&T[0].isRenderPass===!0;let A=o.width,v=o.height;T.length>0&&a===null&&(a=new Ai(A,v,{type:As,depthBuffer:!1,stencilBuffer:!1}),l=new Ai(A,v,{type:As,depthBuffer:!1,stencilBuffer:!1}));let E=s===!0&&T.some(k=>k.needsDepthTexture===!0);E!==(o.depthTexture!==null)&&(E===!0&&c===null&&(c=new Es(A,v),r===!0&&(c.format=Sr,c.type=Go)),o.dispose(),o.depthTexture=E?c:null,o.resolveDepthBuffer=E,o.storeMultisampledDepthBuffer=E);for(let k=0;k<T.length;k++){let U=T[k];U.setSize&&U.setSize(A,v),E&&U.needsDepthTexture===!0&&U.setDepthTexture&&U.setDepthTexture(c)}},this.begin=function(R,A){if(g||R.toneMapping===Ws&&T.length===0)return!1;if(x=A,A!==null){let v=A.width,E=A.height;(o.width!==v||o.height!==E)&&this.setSize(v,E)}return b===!1&&R.setRenderTarget(o),p=R.toneMapping,R.toneMapping=Ws,!0},this.hasRenderPass=function(){return b},this.end=function(R,A){R.toneMapping=p,g=!0;let v=o,E=a;for(let k=0;k<T.length;k++){let U=T[k];U.enabled!==!1&&(U.render(R,E,v,A),U.needsSwap!==!1&&(v=E,E=E===a?l:a))}if(m!==R.outputColorSpace||y!==R.toneMapping){m=R.outputColorSpace,y=R.toneMapping,h.defines={},vt.getTransfer(m)===Pt&&(h.defines.SRGB_TRANSFER="");let k=$T[y];k&&(h.defines[k]=""),h.needsUpdate=!0}h.uniforms.tDiffuse.value=v.texture,R.setRenderTarget(x),R.render(d,f),x=null,g=!1},this.isCompositing=function(){return g},this.dispose=function(){o.dispose(),a!==null&&a.dispose(),l!==null&&l.dispose(),u.dispose(),h.dispose()}}var sy=new Ui,ry=new Es(1,1),oy=new Mc(1),ay=new mc,ly=new Th,cy=new Sc,Fv=[],Bv=[],kv=new Float32Array(16),zv=new Float32Array(9),Vv=new Float32Array(4);function al(n,e,t){let i=n[0];if(i<=0||i>0)return n;let s=e*t,r=Fv[s];if(r===void 0&&(r=new Float32Array(s),Fv[s]=r),e!==0){i.toArray(r,0);for(let o=1,a=0;o!==e;++o)a+=t,n[o].toArray(r,a)}return r}function kn(n,e){if(n.length!==e.length)return!1;for(let t=0,i=n.length;t<i;t++)if(n[t]!==e[t])return!1;return!0}function zn(n,e){for(let t=0,i=e.length;t<i;t++)n[t]=e[t]}function kd(n,e){let t=Bv[e];t===void 0&&(t=new Int32Array(e),Bv[e]=t);for(let i=0;i!==e;++i)t[i]=n.allocateTextureUnit();return t}function WT(n,e){let t=this.cache;t[0]!==e&&(n.uniform1f(this.addr,e),t[0]=e)}function XT(n,e){let t=this.cache;if(e.x!==void 0)(t[0]!==e.x||t[1]!==e.y)&&(n.uniform2f(this.addr,e.x,e.y),t[0]=e.x,t[1]=e.y);else{if(kn(t,e))return;n.uniform2fv(this.addr,e),zn(t,e)}}function qT(n,e){let t=this.cache;if(e.x!==void 0)(t[0]!==e.x||t[1]!==e.y||t[2]!==e.z)&&(n.uniform3f(this.addr,e.x,e.y,e.z),t[0]=e.x,t[1]=e.y,t[2]=e.z);else if(e.r!==void 0)(t[0]!==e.r||t[1]!==e.g||t[2]!==e.b)&&(n.uniform3f(this.addr,e.r,e.g,e.b),t[0]=e.r,t[1]=e.g,t[2]=e.b);else{if(kn(t,e))return;n.uniform3fv(this.addr,e),zn(t,e)}}function YT(n,e){let t=this.cache;if(e.x!==void 0)(t[0]!==e.x||t[1]!==e.y||t[2]!==e.z||t[3]!==e.w)&&(n.uniform4f(this.addr,e.x,e.y,e.z,e.w),t[0]=e.x,t[1]=e.y,t[2]=e.z,t[3]=e.w);else{if(kn(t,e))return;n.uniform4fv(this.addr,e),zn(t,e)}}function jT(n,e){let t=this.cache,i=e.elements;if(i===void 0){if(kn(t,e))return;n.uniformMatrix2fv(this.addr,!1,e),zn(t,e)}else{if(kn(t,i))return;Vv.set(i),n.uniformMatrix2fv(this.addr,!1,Vv),zn(t,i)}}function ZT(n,e){let t=this.cache,i=e.elements;if(i===void 0){if(kn(t,e))return;n.uniformMatrix3fv(this.addr,!1,e),zn(t,e)}else{if(kn(t,i))return;zv.set(i),n.uniformMatrix3fv(this.addr,!1,zv),zn(t,i)}}function JT(n,e){let t=this.cache,i=e.elements;if(i===void 0){if(kn(t,e))return;n.uniformMatrix4fv(this.addr,!1,e),zn(t,e)}else{if(kn(t,i))return;kv.set(i),n.uniformMatrix4fv(this.addr,!1,kv),zn(t,i)}}function KT(n,e){let t=this.cache;t[0]!==e&&(n.uniform1i(this.addr,e),t[0]=e)}function QT(n,e){let t=this.cache;if(e.x!==void 0)(t[0]!==e.x||t[1]!==e.y)&&(n.uniform2i(this.addr,e.x,e.y),t[0]=e.x,t[1]=e.y);else{if(kn(t,e))return;n.uniform2iv(this.addr,e),zn(t,e)}}function eA(n,e){let t=this.cache;if(e.x!==void 0)(t[0]!==e.x||t[1]!==e.y||t[2]!==e.z)&&(n.uniform3i(this.addr,e.x,e.y,e.z),t[0]=e.x,t[1]=e.y,t[2]=e.z);else{if(kn(t,e))return;n.uniform3iv(this.addr,e),zn(t,e)}}function tA(n,e){let t=this.cache;if(e.x!==void 0)(t[0]!==e.x||t[1]!==e.y||t[2]!==e.z||t[3]!==e.w)&&(n.uniform4i(this.addr,e.x,e.y,e.z,e.w),t[0]=e.x,t[1]=e.y,t[2]=e.z,t[3]=e.w);else{if(kn(t,e))return;n.uniform4iv(this.addr,e),zn(t,e)}}function nA(n,e){let t=this.cache;t[0]!==e&&(n.uniform1ui(this.addr,e),t[0]=e)}function iA(n,e){let t=this.cache;if(e.x!==void 0)(t[0]!==e.x||t[1]!==e.y)&&(n.uniform2ui(this.addr,e.x,e.y),t[0]=e.x,t[1]=e.y);else{if(kn(t,e))return;n.uniform2uiv(this.addr,e),zn(t,e)}}function sA(n,e){let t=this.cache;if(e.x!==void 0)(t[0]!==e.x||t[1]!==e.y||t[2]!==e.z)&&(n.uniform3ui(this.addr,e.x,e.y,e.z),t[0]=e.x,t[1]=e.y,t[2]=e.z);else{if(kn(t,e))return;n.uniform3uiv(this.addr,e),zn(t,e)}}function rA(n,e){let t=this.cache;if(e.x!==void 0)(t[0]!==e.x||t[1]!==e.y||t[2]!==e.z||t[3]!==e.w)&&(n.uniform4ui(this.addr,e.x,e.y,e.z,e.w),t[0]=e.x,t[1]=e.y,t[2]=e.z,t[3]=e.w);else{if(kn(t,e))return;n.uniform4uiv(this.addr,e),zn(t,e)}}function zd(n){return n.version===0&&(n.compareFunction=Em,n.needsUpdate=!0),n}function oA(n,e,t){let i=this.cache,s=t.allocateTextureUnit();i[0]!==s&&(n.uniform1i(this.addr,s),i[0]=s);let r;this.type===n.SAMPLER_2D_SHADOW?r=zd(ry):r=sy,t.setTexture2D(e||r,s)}function aA(n,e,t){let i=this.cache,s=t.allocateTextureUnit();i[0]!==s&&(n.uniform1i(this.addr,s),i[0]=s),t.setTexture3D(e||ly,s)}function lA(n,e,t){let i=this.cache,s=t.allocateTextureUnit();i[0]!==s&&(n.uniform1i(this.addr,s),i[0]=s);let r;this.type===n.SAMPLER_CUBE_SHADOW?r=zd(oy):r=cy,t.setTextureCube(e||r,s)}function cA(n,e,t){let i=this.cache,s=t.allocateTextureUnit();i[0]!==s&&(n.uniform1i(this.addr,s),i[0]=s),t.setTexture2DArray(e||ay,s)}function uA(n){switch(n){case 5126:return WT;case 35664:return XT;case 35665:return qT;case 35666:return YT;case 35674:return jT;case 35675:return ZT;case 35676:return JT;case 5124:case 35670:return KT;case 35667:case 35671:return QT;case 35668:case 35672:return eA;case 35669:case 35673:return tA;case 5125:return nA;case 36294:return iA;case 36295:return sA;case 36296:return rA;case 35678:case 36198:case 36298:case 36306:case 35682:return oA;case 35679:case 36299:case 36307:return aA;case 35680:case 36300:case 36308:case 36293:return lA;case 36289:case 36303:case 36311:case 36292:return cA}}function hA(n,e){n.uniform1fv(this.addr,e)}function dA(n,e){let t=al(e,this.size,2);n.uniform2fv(this.addr,t)}function fA(n,e){let t=al(e,this.size,3);n.uniform3fv(this.addr,t)}function pA(n,e){let t=al(e,this.size,4);n.uniform4fv(this.addr,t)}function mA(n,e){let t=al(e,this.size,4);n.uniformMatrix2fv(this.addr,!1,t)}function gA(n,e){let t=al(e,this.size,9);n.uniformMatrix3fv(this.addr,!1,t)}function _A(n,e){let t=al(e,this.size,16);n.uniformMatrix4fv(this.addr,!1,t)}function vA(n,e){n.uniform1iv(this.addr,e)}function yA(n,e){n.uniform2iv(this.addr,e)}function xA(n,e){n.uniform3iv(this.addr,e)}function bA(n,e){n.uniform4iv(this.addr,e)}function SA(n,e){n.uniform1uiv(this.addr,e)}function MA(n,e){n.uniform2uiv(this.addr,e)}function wA(n,e){n.uniform3uiv(this.addr,e)}function EA(n,e){n.uniform4uiv(this.addr,e)}function TA(n,e,t){let i=this.cache,s=e.length,r=kd(t,s);kn(i,r)||(n.uniform1iv(this.addr,r),zn(i,r));let o;this.type===n.SAMPLER_2D_SHADOW?o=zd(ry):o=sy;for(let a=0;a!==s;++a)t.setTexture2D(e[a]||o,r[a])}function AA(n,e,t){let i=this.cache,s=e.length,r=kd(t,s);kn(i,r)||(n.uniform1iv(this.addr,r),zn(i,r));for(let o=0;o!==s;++o)t.setTexture3D(e[o]||ly,r[o])}function CA(n,e,t){let i=this.cache,s=e.length,r=kd(t,s);kn(i,r)||(n.uniform1iv(this.addr,r),zn(i,r));let o;this.type===n.SAMPLER_CUBE_SHADOW?o=zd(oy):o=cy;for(let a=0;a!==s;++a)t.setTextureCube(e[a]||o,r[a])}function RA(n,e,t){let i=this.cache,s=e.length,r=kd(t,s);kn(i,r)||(n.uniform1iv(this.addr,r),zn(i,r));for(let o=0;o!==s;++o)t.setTexture2DArray(e[o]||ay,r[o])}function PA(n){switch(n){case 5126:return hA;case 35664:return dA;case 35665:return fA;case 35666:return pA;case 35674:return mA;case 35675:return gA;case 35676:return _A;case 5124:case 35670:return vA;case 35667:case 35671:return yA;case 35668:case 35672:return xA;case 35669:case 35673:return bA;case 5125:return SA;case 36294:return MA;case 36295:return wA;case 36296:return EA;case 35678:case 36198:case 36298:case 36306:case 35682:return TA;case 35679:case 36299:case 36307:return AA;case 35680:case 36300:case 36308:case 36293:return CA;case 36289:case 36303:case 36311:case 36292:return RA}}var Bm=class{constructor(e,t,i){this.id=e,this.addr=i,this.cache=[],this.type=t.type,this.setValue=uA(t.type)}},km=class{constructor(e,t,i){this.id=e,this.addr=i,this.cache=[],this.type=t.type,this.size=t.size,this.setValue=PA(t.type)}},zm=class{constructor(e){this.id=e,this.seq=[],this.map={}}setValue(e,t,i){let s=this.seq;for(let r=0,o=s.length;r!==o;++r){let a=s[r];a.setValue(e,t[a.id],i)}}},Om=/(\w+)(\])?(\[|\.)?/g;function Hv(n,e){n.seq.push(e),n.map[e.id]=e}function IA(n,e,t){let i=n.name,s=i.length;for(Om.lastIndex=0;;){let r=Om.exec(i),o=Om.lastIndex,a=r[1],l=r[2]==="]",c=r[3];if(l&&(a=a|0),c===void 0||c==="["&&o+2===s){Hv(t,c===void 0?new Bm(a,n,e):new km(a,n,e));break}else{let h=t.map[a];h===void 0&&(h=new zm(a),Hv(t,h)),t=h}}}var ol=class{constructor(e,t){this.seq=[],this.map={};let i=e.getProgramParameter(t,e.ACTIVE_UNIFORMS);for(let o=0;o<i;++o){let a=e.getActiveUniform(t,o),l=e.getUniformLocation(t,a.name);IA(a,l,this)}let s=[],r=[];for(let o of this.seq)o.type===e.SAMPLER_2D_SHADOW||o.type===e.SAMPLER_CUBE_SHADOW||o.type===e.SAMPLER_2D_ARRAY_SHADOW?s.push(o):r.push(o);s.length>0&&(this.seq=s.concat(r))}setValue(e,t,i,s){let r=this.map[t];r!==void 0&&r.setValue(e,i,s)}setOptional(e,t,i){let s=t[i];s!==void 0&&this.setValue(e,i,s)}static upload(e,t,i,s){for(let r=0,o=t.length;r!==o;++r){let a=t[r],l=i[a.id];l.needsUpdate!==!1&&a.setValue(e,l.value,s)}}static seqWithValue(e,t){let i=[];for(let s=0,r=e.length;s!==r;++s){let o=e[s];o.id in t&&i.push(o)}return i}};function $v(n,e,t){let i=n.createShader(e);return n.shaderSource(i,t),n.compileShader(i),i}var LA=37297,DA=0;function NA(n,e){let t=n.split(`
`),i=[],s=Math.max(e-6,0),r=Math.min(e+6,t.length);for(let o=s;o<r;o++){let a=o+1;i.push(`${a===e?">":" "} ${a}: ${t[o]}`)}return i.join(`
`)}var Gv=new nt;function UA(n){vt._getMatrix(Gv,vt.workingColorSpace,n);let e=`mat3( ${Gv.elements.map(t=>t.toFixed(4))} )`;switch(vt.getTransfer(n)){case dc:return[e,"LinearTransferOETF"];case Pt:return[e,"sRGBTransferOETF"];default:return Ze("WebGLProgram: Unsupported color space: ",n),[e,"LinearTransferOETF"]}}function Wv(n,e,t){let i=n.getShaderParameter(e,n.COMPILE_STATUS),r=(n.getShaderInfoLog(e)||"").trim();if(i&&r==="")return"";let o=/ERROR: 0:(\d+)/.exec(r);if(o){let a=parseInt(o[1]);return t.toUpperCase()+`

`+r+`

`+NA(n.getShaderSource(e),a)}else return r}function OA(n,e){let t=UA(e);return[`vec4 ${n}( vec4 value ) {`,`	return ${t[1]}( vec4( ${t[0]} * value.rgb, value.a ) );`,"}"].join(`
`)}var FA={[cm]:"Linear",[um]:"Reinhard",[hm]:"Cineon",[dm]:"ACESFilmic",[pm]:"AgX",[mm]:"Neutral",[fm]:"Custom"};function BA(n,e){let t=FA[e];return t===void 0?(Ze("WebGLProgram: Unsupported toneMapping:",e),"vec3 "+n+"( vec3 color ) { return LinearToneMapping( color ); }"):"vec3 "+n+"( vec3 color ) { return "+t+"ToneMapping( color ); }"}var Od=new B;function kA(){vt.getLuminanceCoefficients(Od);let n=Od.x.toFixed(4),e=Od.y.toFixed(4),t=Od.z.toFixed(4);return["float luminance( const in vec3 rgb ) {",`	const vec3 weights = vec3( ${n}, ${e}, ${t} );`,"	return dot( weights, rgb );","}"].join(`
`)}function zA(n){return[n.extensionClipCullDistance?"#extension GL_ANGLE_clip_cull_distance : require":"",n.extensionMultiDraw?"#extension GL_ANGLE_multi_draw : require":""].filter(Xc).join(`
`)}function VA(n){let e=[];for(let t in n){let i=n[t];i!==!1&&e.push("#define "+t+" "+i)}return e.join(`
`)}function HA(n,e){let t={},i=n.getProgramParameter(e,n.ACTIVE_ATTRIBUTES);for(let s=0;s<i;s++){let r=n.getActiveAttrib(e,s),o=r.name,a=1;r.type===n.FLOAT_MAT2&&(a=2),r.type===n.FLOAT_MAT3&&(a=3),r.type===n.FLOAT_MAT4&&(a=4),t[o]={type:r.type,location:n.getAttribLocation(e,o),locationSize:a}}return t}function Xc(n){return n!==""}function Xv(n,e){let t=e.numSpotLightShadows+e.numSpotLightMaps-e.numSpotLightShadowsWithMaps;return n.replace(/NUM_SUN_LIGHTS/g,e.numSunLights).replace(/NUM_DIR_LIGHTS/g,e.numDirLights).replace(/NUM_SPOT_LIGHTS/g,e.numSpotLights).replace(/NUM_SPOT_LIGHT_MAPS/g,e.numSpotLightMaps).replace(/NUM_SPOT_LIGHT_COORDS/g,t).replace(/NUM_RECT_AREA_LIGHTS/g,e.numRectAreaLights).replace(/NUM_POINT_LIGHTS/g,e.numPointLights).replace(/NUM_HEMI_LIGHTS/g,e.numHemiLights).replace(/NUM_SUN_LIGHT_SHADOWS/g,e.numSunLightShadows).replace(/NUM_DIR_LIGHT_SHADOWS/g,e.numDirLightShadows).replace(/NUM_SPOT_LIGHT_SHADOWS_WITH_MAPS/g,e.numSpotLightShadowsWithMaps).replace(/NUM_SPOT_LIGHT_SHADOWS/g,e.numSpotLightShadows).replace(/NUM_POINT_LIGHT_SHADOWS/g,e.numPointLightShadows).replace(/NUM_LIGHT_PROBE_GRIDS/g,e.numLightProbeGrids)}function qv(n,e){return n.replace(/NUM_CLIPPING_PLANES/g,e.numClippingPlanes).replace(/UNION_CLIPPING_PLANES/g,e.numClippingPlanes-e.numClipIntersection)}var $A=/^[ \t]*#include +<([\w\d./]+)>/gm;function Vm(n){return n.replace($A,GA)}function GA(n,e){let t=pt[e];if(t===void 0)throw new Error("THREE.WebGLProgram: Can not resolve #include <"+e+">");return Vm(t)}var WA=/#pragma unroll_loop_start\s+for\s*\(\s*int\s+i\s*=\s*(\d+)\s*;\s*i\s*<\s*(\d+)\s*;\s*i\s*\+\+\s*\)\s*{([\s\S]+?)}\s+#pragma unroll_loop_end/g;function Yv(n){return n.replace(WA,XA)}function XA(n,e,t,i){let s="";for(let r=parseInt(e);r<parseInt(t);r++)s+=i.replace(/\[\s*i\s*\]/g,"[ "+r+" ]").replace(/UNROLLED_LOOP_INDEX/g,r);return s}function jv(n){let e=`precision ${n.precision} float;
	precision ${n.precision} int;
	precision ${n.precision} sampler2D;
	precision ${n.precision} samplerCube;
	precision ${n.precision} sampler3D;
	precision ${n.precision} sampler2DArray;
	precision ${n.precision} sampler2DShadow;
	precision ${n.precision} samplerCubeShadow;
	precision ${n.precision} sampler2DArrayShadow;
	precision ${n.precision} isampler2D;
	precision ${n.precision} isampler3D;
	precision ${n.precision} isamplerCube;
	precision ${n.precision} isampler2DArray;
	precision ${n.precision} usampler2D;
	precision ${n.precision} usampler3D;
	precision ${n.precision} usamplerCube;
	precision ${n.precision} usampler2DArray;
	`;return n.precision==="highp"?e+=`
#define HIGH_PRECISION`:n.precision==="mediump"?e+=`
#define MEDIUM_PRECISION`:n.precision==="lowp"&&(e+=`
#define LOW_PRECISION`),e}var qA={[Oc]:"SHADOWMAP_TYPE_PCF",[nl]:"SHADOWMAP_TYPE_VSM"};function YA(n){return qA[n.shadowMapType]||"SHADOWMAP_TYPE_BASIC"}var jA={[sl]:"ENVMAP_MODE_REFRACTION"};function ZA(n){return n.envMap===!1?"ENVMAP_MODE_REFLECTION":jA[n.envMapMode]||"ENVMAP_MODE_REFLECTION"}var JA={[Xh]:"ENVMAP_BLENDING_MULTIPLY",[mv]:"ENVMAP_BLENDING_MIX",[gv]:"ENVMAP_BLENDING_ADD"};function KA(n){return n.envMap===!1?"ENVMAP_BLENDING_NONE":JA[n.combine]||"ENVMAP_BLENDING_NONE"}function QA(n,e,t,i){let s=n.getContext(),r=t.defines,o=t.vertexShader,a=t.fragmentShader,l=YA(t),c=t.envMapPMREM===!0?"ENVMAP_TYPE_PMREM":"ENVMAP_TYPE_CUBE",u=ZA(t),h=KA(t),d=zA(t),f=VA(r),m=s.createProgram(),y,g,p=t.glslVersion?"#version "+t.glslVersion+`
`:"";t.isRawShaderMaterial?(y=["#define SHADER_TYPE "+t.shaderType,"#define SHADER_NAME "+t.shaderName,f].filter(Xc).join(`
`),y.length>0&&(y+=`
`),g=["#define SHADER_TYPE "+t.shaderType,"#define SHADER_NAME "+t.shaderName,f].filter(Xc).join(`
`),g.length>0&&(g+=`
`)):(y=[jv(t),"#define SHADER_TYPE "+t.shaderType,"#define SHADER_NAME "+t.shaderName,f,t.extensionClipCullDistance?"#define USE_CLIP_DISTANCE":"",t.batching?"#define USE_BATCHING":"",t.batchingColor?"#define USE_BATCHING_COLOR":"",t.instancing?"#define USE_INSTANCING":"",t.instancingColor?"#define USE_INSTANCING_COLOR":"",t.instancingMorph?"#define USE_INSTANCING_MORPH":"",t.useFog&&t.fog?"#define USE_FOG":"",t.useFog&&t.fogExp2?"#define FOG_EXP2":"",t.map?"#define USE_MAP":"",t.envMap?"#define USE_ENVMAP":"",t.envMap?"#define "+u:"",t.lightMap?"#define USE_LIGHTMAP":"",t.aoMap?"#define USE_AOMAP":"",t.bumpMap?"#define USE_BUMPMAP":"",t.normalMap?"#define USE_NORMALMAP":"",t.normalMapObjectSpace?"#define USE_NORMALMAP_OBJECTSPACE":"",t.normalMapTangentSpace?"#define USE_NORMALMAP_TANGENTSPACE":"",t.displacementMap?"#define USE_DISPLACEMENTMAP":"",t.emissiveMap?"#define USE_EMISSIVEMAP":"",t.anisotropy?"#define USE_ANISOTROPY":"",t.anisotropyMap?"#define USE_ANISOTROPYMAP":"",t.clearcoatMap?"#define USE_CLEARCOATMAP":"",t.clearcoatRoughnessMap?"#define USE_CLEARCOAT_ROUGHNESSMAP":"",t.clearcoatNormalMap?"#define USE_CLEARCOAT_NORMALMAP":"",t.diffuseRoughnessMap?"#define USE_DIFFUSE_ROUGHNESSMAP":"",t.iridescenceMap?"#define USE_IRIDESCENCEMAP":"",t.iridescenceThicknessMap?"#define USE_IRIDESCENCE_THICKNESSMAP":"",t.specularMap?"#define USE_SPECULARMAP":"",t.specularColorMap?"#define USE_SPECULAR_COLORMAP":"",t.specularIntensityMap?"#define USE_SPECULAR_INTENSITYMAP":"",t.roughnessMap?"#define USE_ROUGHNESSMAP":"",t.metalnessMap?"#define USE_METALNESSMAP":"",t.alphaMap?"#define USE_ALPHAMAP":"",t.alphaHash?"#define USE_ALPHAHASH":"",t.transmission?"#define USE_TRANSMISSION":"",t.transmissionMap?"#define USE_TRANSMISSIONMAP":"",t.thicknessMap?"#define USE_THICKNESSMAP":"",t.sheenColorMap?"#define USE_SHEEN_COLORMAP":"",t.sheenRoughnessMap?"#define USE_SHEEN_ROUGHNESSMAP":"",t.mapUv?"#define MAP_UV "+t.mapUv:"",t.alphaMapUv?"#define ALPHAMAP_UV "+t.alphaMapUv:"",t.lightMapUv?"#define LIGHTMAP_UV "+t.lightMapUv:"",t.aoMapUv?"#define AOMAP_UV "+t.aoMapUv:"",t.emissiveMapUv?"#define EMISSIVEMAP_UV "+t.emissiveMapUv:"",t.bumpMapUv?"#define BUMPMAP_UV "+t.bumpMapUv:"",t.normalMapUv?"#define NORMALMAP_UV "+t.normalMapUv:"",t.displacementMapUv?"#define DISPLACEMENTMAP_UV "+t.displacementMapUv:"",t.metalnessMapUv?"#define METALNESSMAP_UV "+t.metalnessMapUv:"",t.roughnessMapUv?"#define ROUGHNESSMAP_UV "+t.roughnessMapUv:"",t.anisotropyMapUv?"#define ANISOTROPYMAP_UV "+t.anisotropyMapUv:"",t.clearcoatMapUv?"#define CLEARCOATMAP_UV "+t.clearcoatMapUv:"",t.clearcoatNormalMapUv?"#define CLEARCOAT_NORMALMAP_UV "+t.clearcoatNormalMapUv:"",t.clearcoatRoughnessMapUv?"#define CLEARCOAT_ROUGHNESSMAP_UV "+t.clearcoatRoughnessMapUv:"",t.diffuseRoughnessMapUv?"#define DIFFUSE_ROUGHNESSMAP_UV "+t.diffuseRoughnessMapUv:"",t.iridescenceMapUv?"#define IRIDESCENCEMAP_UV "+t.iridescenceMapUv:"",t.iridescenceThicknessMapUv?"#define IRIDESCENCE_THICKNESSMAP_UV "+t.iridescenceThicknessMapUv:"",t.sheenColorMapUv?"#define SHEEN_COLORMAP_UV "+t.sheenColorMapUv:"",t.sheenRoughnessMapUv?"#define SHEEN_ROUGHNESSMAP_UV "+t.sheenRoughnessMapUv:"",t.specularMapUv?"#define SPECULARMAP_UV "+t.specularMapUv:"",t.specularColorMapUv?"#define SPECULAR_COLORMAP_UV "+t.specularColorMapUv:"",t.specularIntensityMapUv?"#define SPECULAR_INTENSITYMAP_UV "+t.specularIntensityMapUv:"",t.transmissionMapUv?"#define TRANSMISSIONMAP_UV "+t.transmissionMapUv:"",t.thicknessMapUv?"#define THICKNESSMAP_UV "+t.thicknessMapUv:"",t.vertexTangents&&t.flatShading===!1?"#define USE_TANGENT":"",t.vertexNormals?"#define HAS_NORMAL":"",t.vertexColors?"#define USE_COLOR":"",t.vertexAlphas?"#define USE_COLOR_ALPHA":"",t.vertexUv1s?"#define USE_UV1":"",t.vertexUv2s?"#define USE_UV2":"",t.vertexUv3s?"#define USE_UV3":"",t.pointsUvs?"#define USE_POINTS_UV":"",t.flatShading?"#define FLAT_SHADED":"",t.skinning?"#define USE_SKINNING":"",t.morphTargets?"#define USE_MORPHTARGETS":"",t.morphNormals&&t.flatShading===!1?"#define USE_MORPHNORMALS":"",t.morphColors?"#define USE_MORPHCOLORS":"",t.morphTargetsCount>0?"#define MORPHTARGETS_TEXTURE_STRIDE "+t.morphTextureStride:"",t.morphTargetsCount>0?"#define MORPHTARGETS_COUNT "+t.morphTargetsCount:"",t.doubleSided?"#define DOUBLE_SIDED":"",t.flipSided?"#define FLIP_SIDED":"",t.shadowMapEnabled?"#define USE_SHADOWMAP":"",t.shadowMapEnabled?"#define "+l:"",t.sizeAttenuation?"#define USE_SIZEATTENUATION":"",t.numLightProbes>0?"#define USE_LIGHT_PROBES":"",t.logarithmicDepthBuffer?"#define USE_LOGARITHMIC_DEPTH_BUFFER":"",t.reversedDepthBuffer?"#define USE_REVERSED_DEPTH_BUFFER":"","uniform mat4 modelMatrix;","uniform mat4 modelViewMatrix;","uniform mat4 projectionMatrix;","uniform mat4 viewMatrix;","uniform mat3 normalMatrix;","uniform vec3 cameraPosition;","uniform bool isOrthographic;","#ifdef USE_INSTANCING","	attribute mat4 instanceMatrix;","#endif","#ifdef USE_INSTANCING_COLOR","	attribute vec3 instanceColor;","#endif","#ifdef USE_INSTANCING_MORPH","	uniform sampler2D morphTexture;","#endif","attribute vec3 position;","attribute vec3 normal;","attribute vec2 uv;","#ifdef USE_UV1","	attribute vec2 uv1;","#endif","#ifdef USE_UV2","	attribute vec2 uv2;","#endif","#ifdef USE_UV3","	attribute vec2 uv3;","#endif","#ifdef USE_TANGENT","	attribute vec4 tangent;","#endif","#if defined( USE_COLOR_ALPHA )","	attribute vec4 color;","#elif defined( USE_COLOR )","	attribute vec3 color;","#endif","#ifdef USE_SKINNING","	attribute vec4 skinIndex;","	attribute vec4 skinWeight;","#endif",`
`].filter(Xc).join(`
`),g=[jv(t),"#define SHADER_TYPE "+t.shaderType,"#define SHADER_NAME "+t.shaderName,f,t.useFog&&t.fog?"#define USE_FOG":"",t.useFog&&t.fogExp2?"#define FOG_EXP2":"",t.alphaToCoverage?"#define ALPHA_TO_COVERAGE":"",t.map?"#define USE_MAP":"",t.matcap?"#define USE_MATCAP":"",t.envMap?"#define USE_ENVMAP":"",t.envMap?"#define "+c:"",t.envMap?"#define "+u:"",t.envMap?"#define "+h:"",t.envMapPMREM?"#define ENVMAP_MAX_LOD "+t.envMapMaxLod+".0":"",t.envMapPMREM?"#define ENVMAP_SIZE "+t.envMapSize+".0":"",t.lightMap?"#define USE_LIGHTMAP":"",t.aoMap?"#define USE_AOMAP":"",t.bumpMap?"#define USE_BUMPMAP":"",t.normalMap?"#define USE_NORMALMAP":"",t.normalMapObjectSpace?"#define USE_NORMALMAP_OBJECTSPACE":"",t.normalMapTangentSpace?"#define USE_NORMALMAP_TANGENTSPACE":"",t.packedNormalMap?"#define USE_PACKED_NORMALMAP":"",t.emissiveMap?"#define USE_EMISSIVEMAP":"",t.anisotropy?"#define USE_ANISOTROPY":"",t.anisotropyMap?"#define USE_ANISOTROPYMAP":"",t.clearcoat?"#define USE_CLEARCOAT":"",t.clearcoatMap?"#define USE_CLEARCOATMAP":"",t.clearcoatRoughnessMap?"#define USE_CLEARCOAT_ROUGHNESSMAP":"",t.clearcoatNormalMap?"#define USE_CLEARCOAT_NORMALMAP":"",t.diffuseRoughness?"#define USE_DIFFUSE_ROUGHNESS":"",t.diffuseRoughnessMap?"#define USE_DIFFUSE_ROUGHNESSMAP":"",t.dispersion?"#define USE_DISPERSION":"",t.retroreflection?"#define USE_RETROREFLECTION":"",t.iridescence?"#define USE_IRIDESCENCE":"",t.iridescenceMap?"#define USE_IRIDESCENCEMAP":"",t.iridescenceThicknessMap?"#define USE_IRIDESCENCE_THICKNESSMAP":"",t.specularMap?"#define USE_SPECULARMAP":"",t.specularColorMap?"#define USE_SPECULAR_COLORMAP":"",t.specularIntensityMap?"#define USE_SPECULAR_INTENSITYMAP":"",t.roughnessMap?"#define USE_ROUGHNESSMAP":"",t.metalnessMap?"#define USE_METALNESSMAP":"",t.alphaMap?"#define USE_ALPHAMAP":"",t.alphaTest?"#define USE_ALPHATEST":"",t.alphaHash?"#define USE_ALPHAHASH":"",t.sheen?"#define USE_SHEEN":"",t.sheenColorMap?"#define USE_SHEEN_COLORMAP":"",t.sheenRoughnessMap?"#define USE_SHEEN_ROUGHNESSMAP":"",t.transmission?"#define USE_TRANSMISSION":"",t.transmissionMap?"#define USE_TRANSMISSIONMAP":"",t.thicknessMap?"#define USE_THICKNESSMAP":"",t.vertexTangents&&t.flatShading===!1?"#define USE_TANGENT":"",t.vertexColors||t.instancingColor?"#define USE_COLOR":"",t.vertexAlphas||t.batchingColor?"#define USE_COLOR_ALPHA":"",t.vertexUv1s?"#define USE_UV1":"",t.vertexUv2s?"#define USE_UV2":"",t.vertexUv3s?"#define USE_UV3":"",t.pointsUvs?"#define USE_POINTS_UV":"",t.gradientMap?"#define USE_GRADIENTMAP":"",t.flatShading?"#define FLAT_SHADED":"",t.doubleSided?"#define DOUBLE_SIDED":"",t.flipSided?"#define FLIP_SIDED":"",t.shadowMapEnabled?"#define USE_SHADOWMAP":"",t.shadowMapEnabled?"#define "+l:"",t.premultipliedAlpha?"#define PREMULTIPLIED_ALPHA":"",t.numLightProbes>0?"#define USE_LIGHT_PROBES":"",t.decodeVideoTexture?"#define DECODE_VIDEO_TEXTURE":"",t.decodeVideoTextureEmissive?"#define DECODE_VIDEO_TEXTURE_EMISSIVE":"",t.logarithmicDepthBuffer?"#define USE_LOGARITHMIC_DEPTH_BUFFER":"",t.reversedDepthBuffer?"#define USE_REVERSED_DEPTH_BUFFER":"","uniform mat4 viewMatrix;","uniform vec3 cameraPosition;","uniform bool isOrthographic;",t.toneMapping!==Ws?"#define TONE_MAPPING":"",t.toneMapping!==Ws?pt.tonemapping_pars_fragment:"",t.toneMapping!==Ws?BA("toneMapping",t.toneMapping):"",t.dithering?"#define DITHERING":"",t.opaque?"#define OPAQUE":"",pt.colorspace_pars_fragment,OA("linearToOutputTexel",t.outputColorSpace),kA(),t.useDepthPacking?"#define DEPTH_PACKING "+t.depthPacking:"",`
`].filter(Xc).join(`
`)),o=Vm(o),o=Xv(o,t),o=qv(o,t),a=Vm(a),a=Xv(a,t),a=qv(a,t),o=Yv(o),a=Yv(a),t.isRawShaderMaterial!==!0&&(p=`#version 300 es
`,y=[d,"#define attribute in","#define varying out","#define texture2D texture"].join(`
`)+`
`+y,g=["#define varying in",t.glslVersion===Wo?"":"layout(location = 0) out highp vec4 pc_fragColor;",t.glslVersion===Wo?"":"#define gl_FragColor pc_fragColor","#define gl_FragDepthEXT gl_FragDepth","#define texture2D texture","#define textureCube texture","#define texture2DProj textureProj","#define texture2DLodEXT textureLod","#define texture2DProjLodEXT textureProjLod","#define textureCubeLodEXT textureLod","#define texture2DGradEXT textureGrad","#define texture2DProjGradEXT textureProjGrad","#define textureCubeGradEXT textureGrad"].join(`
`)+`
`+g);let x=p+y+o,T=p+g+a,b=$v(s,s.VERTEX_SHADER,x),R=$v(s,s.FRAGMENT_SHADER,T);s.attachShader(m,b),s.attachShader(m,R),t.index0AttributeName!==void 0?s.bindAttribLocation(m,0,t.index0AttributeName):t.hasPositionAttribute===!0&&s.bindAttribLocation(m,0,"position"),s.linkProgram(m);function A(U){if(n.debug.checkShaderErrors){let I=s.getProgramInfoLog(m)||"",z=s.getShaderInfoLog(b)||"",H=s.getShaderInfoLog(R)||"",N=I.trim(),G=z.trim(),Y=H.trim(),W=!0,ce=!0;if(s.getProgramParameter(m,s.LINK_STATUS)===!1)if(W=!1,typeof n.debug.onShaderError=="function")n.debug.onShaderError(s,m,b,R);else{let J=Wv(s,b,"vertex"),Q=Wv(s,R,"fragment");tt("WebGLProgram: Shader Error "+s.getError()+" - VALIDATE_STATUS "+s.getProgramParameter(m,s.VALIDATE_STATUS)+`

Material Name: `+U.name+`
Material Type: `+U.type+`

Program Info Log: `+N+`
`+J+`
`+Q)}else N!==""?Ze("WebGLProgram: Program Info Log:",N):(G===""||Y==="")&&(ce=!1);ce&&(U.diagnostics={runnable:W,programLog:N,vertexShader:{log:G,prefix:y},fragmentShader:{log:Y,prefix:g}})}s.deleteShader(b),s.deleteShader(R),v=new ol(s,m),E=HA(s,m)}let v;this.getUniforms=function(){return v===void 0&&A(this),v};let E;this.getAttributes=function(){return E===void 0&&A(this),E};let k=t.rendererExtensionParallelShaderCompile===!1;return this.isReady=function(){return k===!1&&(k=s.getProgramParameter(m,LA)),k},this.destroy=function(){i.releaseStatesOfProgram(this),s.deleteProgram(m),this.program=void 0},this.type=t.shaderType,this.name=t.shaderName,this.id=DA++,this.cacheKey=e,this.usedTimes=1,this.program=m,this.vertexShader=b,this.fragmentShader=R,this}var eC=0,Hm=class{constructor(){this.shaderCache=new Map,this.materialCache=new Map}update(e,t,i){let s=this._getShaderCacheForMaterial(e);return s.has(t)===!1&&(s.add(t),t.usedTimes++),s.has(i)===!1&&(s.add(i),i.usedTimes++),this}remove(e){let t=this.materialCache.get(e);for(let i of t)i.usedTimes--,i.usedTimes===0&&this.shaderCache.delete(i.code);return this.materialCache.delete(e),this}getVertexShaderStage(e){return this._getShaderStage(e.vertexShader)}getFragmentShaderStage(e){return this._getShaderStage(e.fragmentShader)}dispose(){this.shaderCache.clear(),this.materialCache.clear()}_getShaderCacheForMaterial(e){let t=this.materialCache,i=t.get(e);return i===void 0&&(i=new Set,t.set(e,i)),i}_getShaderStage(e){let t=this.shaderCache,i=t.get(e);return i===void 0&&(i=new $m(e),t.set(e,i)),i}},$m=class{constructor(e){this.id=eC++,this.code=e,this.usedTimes=0}};function tC(n){return n===no||n===Hc||n===$c}function nC(n,e,t,i,s,r){let o=new gc,a=new Hm,l=new Set,c=[],u=new Map,h=i.logarithmicDepthBuffer,d={MeshDepthMaterial:"depth",MeshDistanceMaterial:"distance",MeshNormalMaterial:"normal",MeshBasicMaterial:"basic",MeshLambertMaterial:"lambert",MeshPhongMaterial:"phong",MeshToonMaterial:"toon",MeshStandardMaterial:"physical",MeshPhysicalMaterial:"physical",MeshMatcapMaterial:"matcap",LineBasicMaterial:"basic",LineDashedMaterial:"dashed",PointsMaterial:"points",ShadowMaterial:"shadow",SpriteMaterial:"sprite"};function f(v){return l.add(v),v===0?"uv":`uv${v}`}function m(v,E,k,U,I,z){let H=U.fog,N=I.geometry,G=v.isMeshStandardMaterial||v.isMeshLambertMaterial||v.isMeshPhongMaterial?U.environment:null,Y=v.isMeshStandardMaterial||v.isMeshLambertMaterial&&!v.envMap||v.isMeshPhongMaterial&&!v.envMap,W=e.get(v.envMap||G,Y),ce=d[v.type],J=i.precision;v.precision!==null&&(J=i.getMaxPrecision(v.precision),J!==v.precision&&Ze("WebGLProgram.getParameters:",v.precision,"not supported, using",J,"instead."));let Q=N.morphAttributes.position||N.morphAttributes.normal||N.morphAttributes.color,se=Q!==void 0?Q.length:0,de=0;N.morphAttributes.position!==void 0&&(de=1),N.morphAttributes.normal!==void 0&&(de=2),N.morphAttributes.color!==void 0&&(de=3);let he,ee,ge,ye;if(ce){let Re=Ri[ce];he=Re.vertexShader,ee=Re.fragmentShader}else{he=v.vertexShader,ee=v.fragmentShader;let Re=a.getVertexShaderStage(v),ct=a.getFragmentShaderStage(v);a.update(v,Re,ct),ge=Re.id,ye=ct.id}let Ce=n.getRenderTarget(),Me=n.state.buffers.depth.getReversed(),We=I.isInstancedMesh===!0,rt=I.isBatchedMesh===!0,$e=!!v.map,mt=!!v.matcap,dt=!!W,it=dt&&W.isPMREMTexture===!0,nn=!!v.aoMap,qt=!!v.lightMap,bn=!!v.bumpMap&&v.wireframe===!1,Bt=!!v.normalMap,Gn=!!v.displacementMap,Mt=!!v.emissiveMap,Nn=!!v.metalnessMap,ln=!!v.roughnessMap,Sn=v.anisotropy>0,F=v.clearcoat>0,Pe=v.diffuseRoughness>0,Ye=v.dispersion>0,ot=v.retroreflectivity>0,we=v.iridescence>0,Ht=v.sheen>0,He=v.transmission>0,qe=Sn&&!!v.anisotropyMap,C=F&&!!v.clearcoatMap,S=F&&!!v.clearcoatNormalMap,X=F&&!!v.clearcoatRoughnessMap,ue=Pe&&!!v.diffuseRoughnessMap,oe=we&&!!v.iridescenceMap,ve=we&&!!v.iridescenceThicknessMap,xe=Ht&&!!v.sheenColorMap,te=Ht&&!!v.sheenRoughnessMap,ie=!!v.specularMap,me=!!v.specularColorMap,O=!!v.specularIntensityMap,re=He&&!!v.transmissionMap,ne=He&&!!v.thicknessMap,Ee=!!v.gradientMap,_e=!!v.alphaMap,Se=v.alphaTest>0,Ge=!!v.alphaHash,Ke=!!v.extensions,le=Ws;v.toneMapped&&(Ce===null||Ce.isXRRenderTarget===!0)&&(le=n.toneMapping);let ke=it?W.isCompressedCubeTexture?W.image[0].mipmaps:W.mipmaps:null,Qe={shaderID:ce,shaderType:v.type,shaderName:v.name,vertexShader:he,fragmentShader:ee,defines:v.defines,customVertexShaderID:ge,customFragmentShaderID:ye,isRawShaderMaterial:v.isRawShaderMaterial===!0,glslVersion:v.glslVersion,precision:J,batching:rt,batchingColor:rt&&I._colorsTexture!==null,instancing:We,instancingColor:We&&I.instanceColor!==null,instancingMorph:We&&I.morphTexture!==null,outputColorSpace:Ce===null?n.outputColorSpace:Ce.isXRRenderTarget===!0?Ce.texture.colorSpace:vt.workingColorSpace,alphaToCoverage:!!v.alphaToCoverage,map:$e,matcap:mt,envMap:dt,envMapMode:dt&&W.mapping,envMapPMREM:it,envMapMaxLod:it?ke.length-1:null,envMapSize:it?ke[0].width:null,aoMap:nn,lightMap:qt,bumpMap:bn,normalMap:Bt,displacementMap:Gn,emissiveMap:Mt,normalMapObjectSpace:Bt&&v.normalMapType===yv,normalMapTangentSpace:Bt&&v.normalMapType===Dd,packedNormalMap:Bt&&v.normalMapType===Dd&&tC(v.normalMap.format),metalnessMap:Nn,roughnessMap:ln,anisotropy:Sn,anisotropyMap:qe,clearcoat:F,clearcoatMap:C,clearcoatNormalMap:S,clearcoatRoughnessMap:X,diffuseRoughness:Pe,diffuseRoughnessMap:ue,dispersion:Ye,retroreflection:ot,iridescence:we,iridescenceMap:oe,iridescenceThicknessMap:ve,sheen:Ht,sheenColorMap:xe,sheenRoughnessMap:te,specularMap:ie,specularColorMap:me,specularIntensityMap:O,transmission:He,transmissionMap:re,thicknessMap:ne,gradientMap:Ee,opaque:v.transparent===!1&&v.blending===il&&v.alphaToCoverage===!1,alphaMap:_e,alphaTest:Se,alphaHash:Ge,combine:v.combine,mapUv:$e&&f(v.map.channel),aoMapUv:nn&&f(v.aoMap.channel),lightMapUv:qt&&f(v.lightMap.channel),bumpMapUv:bn&&f(v.bumpMap.channel),normalMapUv:Bt&&f(v.normalMap.channel),displacementMapUv:Gn&&f(v.displacementMap.channel),emissiveMapUv:Mt&&f(v.emissiveMap.channel),metalnessMapUv:Nn&&f(v.metalnessMap.channel),roughnessMapUv:ln&&f(v.roughnessMap.channel),anisotropyMapUv:qe&&f(v.anisotropyMap.channel),clearcoatMapUv:C&&f(v.clearcoatMap.channel),clearcoatNormalMapUv:S&&f(v.clearcoatNormalMap.channel),clearcoatRoughnessMapUv:X&&f(v.clearcoatRoughnessMap.channel),diffuseRoughnessMapUv:ue&&f(v.diffuseRoughnessMap.channel),iridescenceMapUv:oe&&f(v.iridescenceMap.channel),iridescenceThicknessMapUv:ve&&f(v.iridescenceThicknessMap.channel),sheenColorMapUv:xe&&f(v.sheenColorMap.channel),sheenRoughnessMapUv:te&&f(v.sheenRoughnessMap.channel),specularMapUv:ie&&f(v.specularMap.channel),specularColorMapUv:me&&f(v.specularColorMap.channel),specularIntensityMapUv:O&&f(v.specularIntensityMap.channel),transmissionMapUv:re&&f(v.transmissionMap.channel),thicknessMapUv:ne&&f(v.thicknessMap.channel),alphaMapUv:_e&&f(v.alphaMap.channel),vertexTangents:!!N.attributes.tangent&&(Bt||Sn),vertexNormals:!!N.attributes.normal,vertexColors:v.vertexColors,vertexAlphas:v.vertexColors===!0&&!!N.attributes.color&&N.attributes.color.itemSize===4,pointsUvs:I.isPoints===!0&&!!N.attributes.uv&&($e||_e),fog:!!H,useFog:v.fog===!0,fogExp2:!!H&&H.isFogExp2,flatShading:v.wireframe===!1&&(v.flatShading===!0||N.attributes.normal===void 0&&Bt===!1&&(v.isMeshLambertMaterial||v.isMeshPhongMaterial||v.isMeshStandardMaterial||v.isMeshPhysicalMaterial)),sizeAttenuation:v.sizeAttenuation===!0,logarithmicDepthBuffer:h,reversedDepthBuffer:Me,skinning:I.isSkinnedMesh===!0,hasPositionAttribute:N.attributes.position!==void 0,morphTargets:N.morphAttributes.position!==void 0,morphNormals:N.morphAttributes.normal!==void 0,morphColors:N.morphAttributes.color!==void 0,morphTargetsCount:se,morphTextureStride:de,numSunLights:E.sun.length,numDirLights:E.directional.length,numPointLights:E.point.length,numSpotLights:E.spot.length,numSpotLightMaps:E.spotLightMap.length,numRectAreaLights:E.rectArea.length,numHemiLights:E.hemi.length,numSunLightShadows:E.sunShadowMap.length,numDirLightShadows:E.directionalShadowMap.length,numPointLightShadows:E.pointShadowMap.length,numSpotLightShadows:E.spotShadowMap.length,numSpotLightShadowsWithMaps:E.numSpotLightShadowsWithMaps,numLightProbes:E.numLightProbes,numLightProbeGrids:z.filter(Re=>Re.texture!==null).length,numClippingPlanes:r.numPlanes,numClipIntersection:r.numIntersection,dithering:v.dithering,shadowMapEnabled:n.shadowMap.enabled&&k.length>0,shadowMapType:n.shadowMap.type,toneMapping:le,decodeVideoTexture:$e&&v.map.isVideoTexture===!0&&vt.getTransfer(v.map.colorSpace)===Pt,decodeVideoTextureEmissive:Mt&&v.emissiveMap.isVideoTexture===!0&&vt.getTransfer(v.emissiveMap.colorSpace)===Pt,premultipliedAlpha:v.premultipliedAlpha,doubleSided:v.side===os,flipSided:v.side===Ci,useDepthPacking:v.depthPacking>=0,depthPacking:v.depthPacking||0,index0AttributeName:v.index0AttributeName,extensionClipCullDistance:Ke&&v.extensions.clipCullDistance===!0&&t.has("WEBGL_clip_cull_distance"),extensionMultiDraw:(Ke&&v.extensions.multiDraw===!0||rt)&&t.has("WEBGL_multi_draw"),rendererExtensionParallelShaderCompile:t.has("KHR_parallel_shader_compile"),customProgramCacheKey:v.customProgramCacheKey()};return Qe.vertexUv1s=l.has(1),Qe.vertexUv2s=l.has(2),Qe.vertexUv3s=l.has(3),l.clear(),Qe}function y(v){let E=[];if(v.shaderID?E.push(v.shaderID):(E.push(v.customVertexShaderID),E.push(v.customFragmentShaderID)),v.defines!==void 0)for(let k in v.defines)E.push(k),E.push(v.defines[k]);return v.isRawShaderMaterial===!1&&(g(E,v),p(E,v),E.push(n.outputColorSpace)),E.push(v.customProgramCacheKey),E.join()}function g(v,E){v.push(E.precision),v.push(E.outputColorSpace),v.push(E.envMapMode),v.push(E.envMapPMREM),v.push(E.envMapMaxLod),v.push(E.envMapSize),v.push(E.mapUv),v.push(E.alphaMapUv),v.push(E.lightMapUv),v.push(E.aoMapUv),v.push(E.bumpMapUv),v.push(E.normalMapUv),v.push(E.displacementMapUv),v.push(E.emissiveMapUv),v.push(E.metalnessMapUv),v.push(E.roughnessMapUv),v.push(E.anisotropyMapUv),v.push(E.clearcoatMapUv),v.push(E.clearcoatNormalMapUv),v.push(E.clearcoatRoughnessMapUv),v.push(E.diffuseRoughnessMapUv),v.push(E.iridescenceMapUv),v.push(E.iridescenceThicknessMapUv),v.push(E.sheenColorMapUv),v.push(E.sheenRoughnessMapUv),v.push(E.specularMapUv),v.push(E.specularColorMapUv),v.push(E.specularIntensityMapUv),v.push(E.transmissionMapUv),v.push(E.thicknessMapUv),v.push(E.combine),v.push(E.fogExp2),v.push(E.sizeAttenuation),v.push(E.morphTargetsCount),v.push(E.numSunLights),v.push(E.numDirLights),v.push(E.numPointLights),v.push(E.numSpotLights),v.push(E.numSpotLightMaps),v.push(E.numHemiLights),v.push(E.numRectAreaLights),v.push(E.numSunLightShadows),v.push(E.numDirLightShadows),v.push(E.numPointLightShadows),v.push(E.numSpotLightShadows),v.push(E.numSpotLightShadowsWithMaps),v.push(E.numLightProbes),v.push(E.numLightProbeGrids),v.push(E.shadowMapType),v.push(E.toneMapping),v.push(E.numClippingPlanes),v.push(E.numClipIntersection),v.push(E.depthPacking)}function p(v,E){o.disableAll(),E.instancing&&o.enable(0),E.instancingColor&&o.enable(1),E.instancingMorph&&o.enable(2),E.matcap&&o.enable(3),E.envMap&&o.enable(4),E.normalMapObjectSpace&&o.enable(5),E.normalMapTangentSpace&&o.enable(6),E.clearcoat&&o.enable(7),E.iridescence&&o.enable(8),E.alphaTest&&o.enable(9),E.vertexColors&&o.enable(10),E.vertexAlphas&&o.enable(11),E.vertexUv1s&&o.enable(12),E.vertexUv2s&&o.enable(13),E.vertexUv3s&&o.enable(14),E.vertexTangents&&o.enable(15),E.anisotropy&&o.enable(16),E.alphaHash&&o.enable(17),E.batching&&o.enable(18),E.dispersion&&o.enable(19),E.retroreflection&&o.enable(24),E.diffuseRoughness&&o.enable(25),E.batchingColor&&o.enable(20),E.gradientMap&&o.enable(21),E.packedNormalMap&&o.enable(22),E.vertexNormals&&o.enable(23),v.push(o.mask),o.disableAll(),E.fog&&o.enable(0),E.useFog&&o.enable(1),E.flatShading&&o.enable(2),E.logarithmicDepthBuffer&&o.enable(3),E.reversedDepthBuffer&&o.enable(4),E.skinning&&o.enable(5),E.morphTargets&&o.enable(6),E.morphNormals&&o.enable(7),E.morphColors&&o.enable(8),E.premultipliedAlpha&&o.enable(9),E.shadowMapEnabled&&o.enable(10),E.doubleSided&&o.enable(11),E.flipSided&&o.enable(12),E.useDepthPacking&&o.enable(13),E.dithering&&o.enable(14),E.transmission&&o.enable(15),E.sheen&&o.enable(16),E.opaque&&o.enable(17),E.pointsUvs&&o.enable(18),E.decodeVideoTexture&&o.enable(19),E.decodeVideoTextureEmissive&&o.enable(20),E.alphaToCoverage&&o.enable(21),E.numLightProbeGrids>0&&o.enable(22),E.hasPositionAttribute&&o.enable(23),v.push(o.mask)}function x(v){let E=d[v.type],k;if(E){let U=Ri[E];k=Gc.clone(U.uniforms)}else k=v.uniforms;return k}function T(v,E){let k=u.get(E);return k!==void 0?++k.usedTimes:(k=new QA(n,E,v,s),c.push(k),u.set(E,k)),k}function b(v){if(--v.usedTimes===0){let E=c.indexOf(v);c[E]=c[c.length-1],c.pop(),u.delete(v.cacheKey),v.destroy()}}function R(v){a.remove(v)}function A(){a.dispose()}return{getParameters:m,getProgramCacheKey:y,getUniforms:x,acquireProgram:T,releaseProgram:b,releaseShaderCache:R,programs:c,dispose:A}}function iC(){let n=new WeakMap;function e(o){return n.has(o)}function t(o){let a=n.get(o);return a===void 0&&(a={},n.set(o,a)),a}function i(o){n.delete(o)}function s(o,a,l){n.get(o)[a]=l}function r(){n=new WeakMap}return{has:e,get:t,remove:i,update:s,dispose:r}}function sC(n,e){return n.groupOrder!==e.groupOrder?n.groupOrder-e.groupOrder:n.renderOrder!==e.renderOrder?n.renderOrder-e.renderOrder:n.material.id!==e.material.id?n.material.id-e.material.id:n.materialVariant!==e.materialVariant?n.materialVariant-e.materialVariant:n.z!==e.z?n.z-e.z:n.id-e.id}function Zv(n,e){return n.groupOrder!==e.groupOrder?n.groupOrder-e.groupOrder:n.renderOrder!==e.renderOrder?n.renderOrder-e.renderOrder:n.z!==e.z?e.z-n.z:n.id-e.id}function Jv(){let n=[],e=0,t=[],i=[],s=[];function r(){e=0,t.length=0,i.length=0,s.length=0}function o(d){let f=0;return d.isInstancedMesh&&(f+=2),d.isSkinnedMesh&&(f+=1),f}function a(d,f,m,y,g,p){let x=n[e];return x===void 0?(x={id:d.id,object:d,geometry:f,material:m,materialVariant:o(d),groupOrder:y,renderOrder:d.renderOrder,z:g,group:p},n[e]=x):(x.id=d.id,x.object=d,x.geometry=f,x.material=m,x.materialVariant=o(d),x.groupOrder=y,x.renderOrder=d.renderOrder,x.z=g,x.group=p),e++,x}function l(d,f,m,y,g,p,x){x.reversedDepth===!0&&(g=-g);let T=a(d,f,m,y,g,p);m.transmission>0?i.push(T):m.transparent===!0?s.push(T):t.push(T)}function c(d,f,m,y,g,p){let x=a(d,f,m,y,g,p);m.transmission>0?i.unshift(x):m.transparent===!0?s.unshift(x):t.unshift(x)}function u(d,f){t.length>1&&t.sort(d||sC),i.length>1&&i.sort(f||Zv),s.length>1&&s.sort(f||Zv)}function h(){for(let d=e,f=n.length;d<f;d++){let m=n[d];if(m.id===null)break;m.id=null,m.object=null,m.geometry=null,m.material=null,m.group=null}}return{opaque:t,transmissive:i,transparent:s,init:r,push:l,unshift:c,finish:h,sort:u}}function rC(){let n=new WeakMap;function e(i,s){let r=n.get(i),o;return r===void 0?(o=new Jv,n.set(i,[o])):s>=r.length?(o=new Jv,r.push(o)):o=r[s],o}function t(){n=new WeakMap}return{get:e,dispose:t}}function oC(){let n={};return{get:function(e){if(n[e.id]!==void 0)return n[e.id];let t;switch(e.type){case"SunLight":case"DirectionalLight":t={direction:new B,color:new lt};break;case"SpotLight":t={position:new B,direction:new B,color:new lt,distance:0,coneCos:0,penumbraCos:0,decay:0};break;case"PointLight":t={position:new B,color:new lt,distance:0,decay:0};break;case"HemisphereLight":t={direction:new B,skyColor:new lt,groundColor:new lt};break;case"RectAreaLight":t={color:new lt,position:new B,halfWidth:new B,halfHeight:new B};break}return n[e.id]=t,t}}}function aC(){let n={};return{get:function(e){if(n[e.id]!==void 0)return n[e.id];let t;switch(e.type){case"SunLight":case"DirectionalLight":t={shadowIntensity:1,shadowBias:0,shadowNormalBias:0,shadowRadius:1,shadowMapSize:new at};break;case"SpotLight":t={shadowIntensity:1,shadowBias:0,shadowNormalBias:0,shadowRadius:1,shadowMapSize:new at};break;case"PointLight":t={shadowIntensity:1,shadowBias:0,shadowNormalBias:0,shadowRadius:1,shadowMapSize:new at,shadowCameraNear:1,shadowCameraFar:1e3};break}return n[e.id]=t,t}}}var lC=0;function cC(n,e){return(e.castShadow?2:0)-(n.castShadow?2:0)+(e.map?1:0)-(n.map?1:0)}function uC(n){let e=new oC,t=aC(),i={version:0,hash:{sunLength:-1,directionalLength:-1,pointLength:-1,spotLength:-1,rectAreaLength:-1,hemiLength:-1,numSunShadows:-1,numDirectionalShadows:-1,numPointShadows:-1,numSpotShadows:-1,numSpotMaps:-1,numLightProbes:-1},ambient:[0,0,0],probe:[],sun:[],sunShadow:[],sunShadowMap:[],sunShadowMatrix:[],sunShadowCascade:[],directional:[],directionalShadow:[],directionalShadowMap:[],directionalShadowMatrix:[],spot:[],spotLightMap:[],spotShadow:[],spotShadowMap:[],spotLightMatrix:[],rectArea:[],rectAreaLTC1:null,rectAreaLTC2:null,point:[],pointShadow:[],pointShadowMap:[],pointShadowMatrix:[],hemi:[],numSpotLightShadowsWithMaps:0,numLightProbes:0};for(let c=0;c<9;c++)i.probe.push(new B);let s=new B,r=new ht,o=new ht;function a(c){let u=0,h=0,d=0;for(let z=0;z<9;z++)i.probe[z].set(0,0,0);let f=0,m=0,y=0,g=0,p=0,x=0,T=0,b=0,R=0,A=0,v=0,E=0,k=0,U=0;c.sort(cC);for(let z=0,H=c.length;z<H;z++){let N=c[z],G=N.color,Y=N.intensity,W=N.distance,ce=null;if(N.shadow&&N.shadow.map&&(N.shadow.map.texture.format===no?ce=N.shadow.map.texture:ce=N.shadow.map.depthTexture||N.shadow.map.texture),N.isAmbientLight)u+=G.r*Y,h+=G.g*Y,d+=G.b*Y;else if(N.isLightProbe){for(let J=0;J<9;J++)i.probe[J].addScaledVector(N.sh.coefficients[J],Y);U++}else if(N.isSunLight){let J=e.get(N);if(J.color.copy(N.color).multiplyScalar(N.intensity),N.castShadow){let Q=N.shadow,se=t.get(N);se.shadowIntensity=Q.intensity,se.shadowBias=Q.bias,se.shadowNormalBias=Q.normalBias,se.shadowRadius=Q.radius,se.shadowMapSize.copy(Q.mapSize).multiply(Q.getFrameExtents()),i.sunShadow[m]=se,i.sunShadowMap[m]=ce;let de=Q.getViewportCount();for(let he=0;he<de;he++)i.sunShadowMatrix[y+he]=Q.getMatrix(he),i.sunShadowCascade[y+he]=Q._cascadeData[he];y+=de,m++}i.sun[f]=J,f++}else if(N.isDirectionalLight){let J=e.get(N);if(J.color.copy(N.color).multiplyScalar(N.intensity),N.castShadow){let Q=N.shadow,se=t.get(N);se.shadowIntensity=Q.intensity,se.shadowBias=Q.bias,se.shadowNormalBias=Q.normalBias,se.shadowRadius=Q.radius,se.shadowMapSize=Q.mapSize,i.directionalShadow[g]=se,i.directionalShadowMap[g]=ce,i.directionalShadowMatrix[g]=N.shadow.matrix,R++}i.directional[g]=J,g++}else if(N.isSpotLight){let J=e.get(N);J.position.setFromMatrixPosition(N.matrixWorld),J.color.copy(G).multiplyScalar(Y),J.distance=W,J.coneCos=Math.cos(N.angle),J.penumbraCos=Math.cos(N.angle*(1-N.penumbra)),J.decay=N.decay,i.spot[x]=J;let Q=N.shadow;if(N.map&&(i.spotLightMap[E]=N.map,E++,Q.updateMatrices(N),N.castShadow&&k++),i.spotLightMatrix[x]=Q.matrix,N.castShadow){let se=t.get(N);se.shadowIntensity=Q.intensity,se.shadowBias=Q.bias,se.shadowNormalBias=Q.normalBias,se.shadowRadius=Q.radius,se.shadowMapSize=Q.mapSize,i.spotShadow[x]=se,i.spotShadowMap[x]=ce,v++}x++}else if(N.isRectAreaLight){let J=e.get(N);J.color.copy(G).multiplyScalar(Y),J.halfWidth.set(N.width*.5,0,0),J.halfHeight.set(0,N.height*.5,0),i.rectArea[T]=J,T++}else if(N.isPointLight){let J=e.get(N);if(J.color.copy(N.color).multiplyScalar(N.intensity),J.distance=N.distance,J.decay=N.decay,N.castShadow){let Q=N.shadow,se=t.get(N);se.shadowIntensity=Q.intensity,se.shadowBias=Q.bias,se.shadowNormalBias=Q.normalBias,se.shadowRadius=Q.radius,se.shadowMapSize=Q.mapSize,se.shadowCameraNear=Q.camera.near,se.shadowCameraFar=Q.camera.far,i.pointShadow[p]=se,i.pointShadowMap[p]=ce,i.pointShadowMatrix[p]=N.shadow.matrix,A++}i.point[p]=J,p++}else if(N.isHemisphereLight){let J=e.get(N);J.skyColor.copy(N.color).multiplyScalar(Y),J.groundColor.copy(N.groundColor).multiplyScalar(Y),i.hemi[b]=J,b++}}T>0&&(n.has("OES_texture_float_linear")===!0?(i.rectAreaLTC1=Ie.LTC_FLOAT_1,i.rectAreaLTC2=Ie.LTC_FLOAT_2):(i.rectAreaLTC1=Ie.LTC_HALF_1,i.rectAreaLTC2=Ie.LTC_HALF_2)),i.ambient[0]=u,i.ambient[1]=h,i.ambient[2]=d;let I=i.hash;(I.sunLength!==f||I.directionalLength!==g||I.pointLength!==p||I.spotLength!==x||I.rectAreaLength!==T||I.hemiLength!==b||I.numSunShadows!==m||I.numDirectionalShadows!==R||I.numPointShadows!==A||I.numSpotShadows!==v||I.numSpotMaps!==E||I.numLightProbes!==U)&&(i.sun.length=f,i.directional.length=g,i.spot.length=x,i.rectArea.length=T,i.point.length=p,i.hemi.length=b,i.sunShadow.length=m,i.sunShadowMap.length=m,i.sunShadowMatrix.length=y,i.sunShadowCascade.length=y,i.directionalShadow.length=R,i.directionalShadowMap.length=R,i.directionalShadowMatrix.length=R,i.pointShadow.length=A,i.pointShadowMap.length=A,i.pointShadowMatrix.length=A,i.spotShadow.length=v,i.spotShadowMap.length=v,i.spotLightMatrix.length=v+E-k,i.spotLightMap.length=E,i.numSpotLightShadowsWithMaps=k,i.numLightProbes=U,I.sunLength=f,I.directionalLength=g,I.pointLength=p,I.spotLength=x,I.rectAreaLength=T,I.hemiLength=b,I.numSunShadows=m,I.numDirectionalShadows=R,I.numPointShadows=A,I.numSpotShadows=v,I.numSpotMaps=E,I.numLightProbes=U,i.version=lC++)}function l(c,u){let h=0,d=0,f=0,m=0,y=0,g=0,p=u.matrixWorldInverse;for(let x=0,T=c.length;x<T;x++){let b=c[x];if(b.isSunLight){let R=i.sun[h];R.direction.setFromMatrixPosition(b.matrixWorld),R.direction.transformDirection(p),h++}else if(b.isDirectionalLight){let R=i.directional[d];R.direction.setFromMatrixPosition(b.matrixWorld),s.setFromMatrixPosition(b.target.matrixWorld),R.direction.sub(s),R.direction.transformDirection(p),d++}else if(b.isSpotLight){let R=i.spot[m];R.position.setFromMatrixPosition(b.matrixWorld),R.position.applyMatrix4(p),R.direction.setFromMatrixPosition(b.matrixWorld),s.setFromMatrixPosition(b.target.matrixWorld),R.direction.sub(s),R.direction.transformDirection(p),m++}else if(b.isRectAreaLight){let R=i.rectArea[y];R.position.setFromMatrixPosition(b.matrixWorld),R.position.applyMatrix4(p),o.identity(),r.copy(b.matrixWorld),r.premultiply(p),o.extractRotation(r),R.halfWidth.set(b.width*.5,0,0),R.halfHeight.set(0,b.height*.5,0),R.halfWidth.applyMatrix4(o),R.halfHeight.applyMatrix4(o),y++}else if(b.isPointLight){let R=i.point[f];R.position.setFromMatrixPosition(b.matrixWorld),R.position.applyMatrix4(p),f++}else if(b.isHemisphereLight){let R=i.hemi[g];R.direction.setFromMatrixPosition(b.matrixWorld),R.direction.transformDirection(p),g++}}}return{setup:a,setupView:l,state:i}}function Kv(n){let e=new uC(n),t=[],i=[],s=[];function r(h){u.camera=h,t.length=0,i.length=0,s.length=0}function o(h){h.isLightProbeGrid?s.push(h):t.push(h)}function a(h){i.push(h)}function l(){e.setup(t),s.sort((h,d)=>h.priority-d.priority||h.id-d.id)}function c(h){e.setupView(t,h)}let u={lightsArray:t,shadowsArray:i,lightProbeGridArray:s,camera:null,lights:e,transmissionRenderTarget:{},textureUnits:0};return{init:r,state:u,setupLights:l,setupLightsView:c,pushLight:o,pushShadow:a}}function hC(n){let e=new WeakMap;function t(s,r=0){let o=e.get(s),a;return o===void 0?(a=new Kv(n),e.set(s,[a])):r>=o.length?(a=new Kv(n),o.push(a)):a=o[r],a}function i(){e=new WeakMap}return{get:t,dispose:i}}var dC=`void main() {
	gl_Position = vec4( position, 1.0 );
}`,fC=`uniform sampler2D shadow_pass;
uniform vec2 resolution;
uniform float radius;
void main() {
	const float samples = float( VSM_SAMPLES );
	float mean = 0.0;
	float squared_mean = 0.0;
	float uvStride = samples <= 1.0 ? 0.0 : 2.0 / ( samples - 1.0 );
	float uvStart = samples <= 1.0 ? 0.0 : - 1.0;
	for ( float i = 0.0; i < samples; i ++ ) {
		float uvOffset = uvStart + i * uvStride;
		#ifdef HORIZONTAL_PASS
			vec2 distribution = texture2D( shadow_pass, ( gl_FragCoord.xy + vec2( uvOffset, 0.0 ) * radius ) / resolution ).rg;
			mean += distribution.x;
			squared_mean += distribution.y * distribution.y + distribution.x * distribution.x;
		#else
			float depth = texture2D( shadow_pass, ( gl_FragCoord.xy + vec2( 0.0, uvOffset ) * radius ) / resolution ).r;
			mean += depth;
			squared_mean += depth * depth;
		#endif
	}
	mean = mean / samples;
	squared_mean = squared_mean / samples;
	float std_dev = sqrt( max( 0.0, squared_mean - mean * mean ) );
	gl_FragColor = vec4( mean, std_dev, 0.0, 1.0 );
}`,pC=[new B(1,0,0),new B(-1,0,0),new B(0,1,0),new B(0,-1,0),new B(0,0,1),new B(0,0,-1)],mC=[new B(0,-1,0),new B(0,-1,0),new B(0,0,1),new B(0,0,-1),new B(0,-1,0),new B(0,-1,0)],Qv=new ht,Wc=new B,Fm=new B;function gC(n,e,t){let i=new Gs,s=new at,r=new at,o=new It,a=new Lh,l=new Dh,c={},u=t.maxTextureSize,h={[to]:Ci,[Ci]:to,[os]:os},d=new hi({defines:{VSM_SAMPLES:8},uniforms:{shadow_pass:{value:null},resolution:{value:new at},radius:{value:4}},vertexShader:dC,fragmentShader:fC}),f=d.clone();f.defines.HORIZONTAL_PASS=1;let m=new Bn;m.setAttribute("position",new fn(new Float32Array([-1,-1,.5,3,-1,.5,-1,3,.5]),3));let y=new Zn(m,d),g=this;this.enabled=!1,this.autoUpdate=!0,this.needsUpdate=!1,this.type=Oc;let p=this.type;this.render=function(A,v,E){if(g.enabled===!1||g.autoUpdate===!1&&g.needsUpdate===!1||A.length===0)return;this.type===Z_&&(Ze("WebGLShadowMap: PCFSoftShadowMap has been removed. Using PCFShadowMap instead."),this.type=Oc);let k=n.getRenderTarget(),U=n.getActiveCubeFace(),I=n.getActiveMipmapLevel(),z=n.state;z.setBlending(Vo),z.buffers.depth.getReversed()===!0?z.buffers.color.setClear(0,0,0,0):z.buffers.color.setClear(1,1,1,1),z.buffers.depth.setTest(!0),z.setScissorTest(!1);let H=p!==this.type;H&&v.traverse(function(N){N.material&&(Array.isArray(N.material)?N.material.forEach(G=>G.needsUpdate=!0):N.material.needsUpdate=!0)});for(let N=0,G=A.length;N<G;N++){let Y=A[N],W=Y.shadow;if(W===void 0){Ze("WebGLShadowMap:",Y,"has no shadow.");continue}if(W.autoUpdate===!1&&W.needsUpdate===!1)continue;s.copy(W.mapSize);let ce=W.getFrameExtents();s.multiply(ce),r.copy(W.mapSize),(s.x>u||s.y>u)&&(s.x>u&&(r.x=Math.floor(u/ce.x),s.x=r.x*ce.x,W.mapSize.x=r.x),s.y>u&&(r.y=Math.floor(u/ce.y),s.y=r.y*ce.y,W.mapSize.y=r.y));let J=n.state.buffers.depth.getReversed();if(W.camera._reversedDepth=J,W.map===null||H===!0){if(W.map!==null&&(W.map.depthTexture!==null&&(W.map.depthTexture.dispose(),W.map.depthTexture=null),W.map.dispose()),this.type===nl){if(Y.isPointLight){Ze("WebGLShadowMap: VSM shadow maps are not supported for PointLights. Use PCF or BasicShadowMap instead.");continue}W.map=new Ai(s.x,s.y,{format:no,type:As,minFilter:Ti,magFilter:Ti,generateMipmaps:!1}),W.map.texture.name=Y.name+".shadowMap",W.map.depthTexture=new Es(s.x,s.y,Oi),W.map.depthTexture.name=Y.name+".shadowMapDepth",W.map.depthTexture.format=vr,W.map.depthTexture.compareFunction=null,W.map.depthTexture.minFilter=Rn,W.map.depthTexture.magFilter=Rn}else Y.isPointLight?(W.map=new qc(s.x),W.map.depthTexture=new Mc(s.x,Ts)):(W.map=new Ai(s.x,s.y),W.map.depthTexture=new Es(s.x,s.y,Ts)),W.map.depthTexture.name=Y.name+".shadowMap",W.map.depthTexture.format=vr,this.type===Oc?(W.map.depthTexture.compareFunction=J?wm:Mm,W.map.depthTexture.minFilter=Ti,W.map.depthTexture.magFilter=Ti):(W.map.depthTexture.compareFunction=null,W.map.depthTexture.minFilter=Rn,W.map.depthTexture.magFilter=Rn);W.camera.updateProjectionMatrix()}W.map.isWebGLCubeRenderTarget!==!0&&(W.map.width!==s.x||W.map.height!==s.y)&&W.map.setSize(s.x,s.y);let Q=W.map.isWebGLCubeRenderTarget?6:W.getViewportCount();Y.isPointLight!==!0&&W.updateMatrices(Y,E);let se=(W.camera.layers.mask&4294967294)!==0?W.camera.layers:E.layers;for(let de=0;de<Q;de++){let he=W.getCamera(de);if(Y.isPointLight){let ee=W.camera,ge=W.matrix,ye=Y.distance||ee.far;ye!==ee.far&&(ee.far=ye,ee.updateProjectionMatrix()),Wc.setFromMatrixPosition(Y.matrixWorld),ee.position.copy(Wc),Fm.copy(ee.position),Fm.add(pC[de]),ee.up.copy(mC[de]),ee.lookAt(Fm),ee.updateMatrixWorld(),ge.makeTranslation(-Wc.x,-Wc.y,-Wc.z),Qv.multiplyMatrices(ee.projectionMatrix,ee.matrixWorldInverse),W._frustum.setFromProjectionMatrix(Qv,ee.coordinateSystem,ee.reversedDepth)}if(W.map.isWebGLCubeRenderTarget)n.setRenderTarget(W.map,de),n.clear();else{de===0&&(n.setRenderTarget(W.map),n.clear());let ee=W.getViewport(de);o.set(r.x*ee.x,r.y*ee.y,r.x*ee.z,r.y*ee.w),z.viewport(o)}i=W.getFrustum(de),b(v,E,he,Y,se,this.type)}W.isPointLightShadow!==!0&&this.type===nl&&x(W,E),W.needsUpdate=!1}p=this.type,g.needsUpdate=!1,n.setRenderTarget(k,U,I)};function x(A,v){let E=e.update(y);d.defines.VSM_SAMPLES!==A.blurSamples&&(d.defines.VSM_SAMPLES=A.blurSamples,f.defines.VSM_SAMPLES=A.blurSamples,d.needsUpdate=!0,f.needsUpdate=!0),A.mapPass===null?A.mapPass=new Ai(s.x,s.y,{format:no,type:As}):(A.mapPass.width!==A.map.width||A.mapPass.height!==A.map.height)&&A.mapPass.setSize(A.map.width,A.map.height),d.uniforms.shadow_pass.value=A.map.depthTexture,d.uniforms.resolution.value.set(A.map.width,A.map.height),d.uniforms.radius.value=A.radius,n.setRenderTarget(A.mapPass),n.clear(),n.renderBufferDirect(v,null,E,d,y,null),f.uniforms.shadow_pass.value=A.mapPass.texture,f.uniforms.resolution.value.set(A.map.width,A.map.height),f.uniforms.radius.value=A.radius,n.setRenderTarget(A.map),n.clear(),n.renderBufferDirect(v,null,E,f,y,null)}function T(A,v,E,k){let U=null,I=E.isPointLight===!0?A.customDistanceMaterial:A.customDepthMaterial;if(I!==void 0)U=I;else if(U=E.isPointLight===!0?l:a,n.localClippingEnabled&&v.clipShadows===!0&&Array.isArray(v.clippingPlanes)&&v.clippingPlanes.length!==0||v.displacementMap&&v.displacementScale!==0||v.alphaMap&&v.alphaTest>0||v.map&&v.alphaTest>0||v.alphaToCoverage===!0){let z=U.uuid,H=v.uuid,N=c[z];N===void 0&&(N={},c[z]=N);let G=N[H];G===void 0&&(G=U.clone(),N[H]=G,v.addEventListener("dispose",R)),U=G}if(U.visible=v.visible,U.wireframe=v.wireframe,k===nl?U.side=v.shadowSide!==null?v.shadowSide:v.side:U.side=v.shadowSide!==null?v.shadowSide:h[v.side],U.alphaMap=v.alphaMap,U.alphaTest=v.alphaToCoverage===!0?.5:v.alphaTest,U.map=v.map,U.clipShadows=v.clipShadows,U.clippingPlanes=v.clippingPlanes,U.clipIntersection=v.clipIntersection,U.displacementMap=v.displacementMap,U.displacementScale=v.displacementScale,U.displacementBias=v.displacementBias,U.wireframeLinewidth=v.wireframeLinewidth,U.linewidth=v.linewidth,E.isPointLight===!0&&U.isMeshDistanceMaterial===!0){let z=n.properties.get(U);z.light=E}return U}function b(A,v,E,k,U,I){if(A.visible===!1)return;if(A.layers.test(U)&&(A.isMesh||A.isLine||A.isPoints)&&(A.castShadow||A.receiveShadow&&I===nl)&&(!A.frustumCulled||A.intersectsFrustum(i))){A.modelViewMatrix.multiplyMatrices(E.matrixWorldInverse,A.matrixWorld);let N=e.update(A),G=A.material;if(Array.isArray(G)){let Y=N.groups;for(let W=0,ce=Y.length;W<ce;W++){let J=Y[W],Q=G[J.materialIndex];if(Q&&Q.visible){let se=T(A,Q,k,I);A.onBeforeShadow(n,A,v,E,N,se,J),n.renderBufferDirect(E,null,N,se,A,J),A.onAfterShadow(n,A,v,E,N,se,J)}}}else if(G.visible){let Y=T(A,G,k,I);A.onBeforeShadow(n,A,v,E,N,Y,null),n.renderBufferDirect(E,null,N,Y,A,null),A.onAfterShadow(n,A,v,E,N,Y,null)}}let H=A.children;for(let N=0,G=H.length;N<G;N++)b(H[N],v,E,k,U,I)}function R(A){A.target.removeEventListener("dispose",R);for(let E in c){let k=c[E],U=A.target.uuid;U in k&&(k[U].dispose(),delete k[U])}}}function _C(n,e){function t(){let O=!1,re=new It,ne=null,Ee=new It(0,0,0,0);return{setMask:function(_e){ne!==_e&&!O&&(n.colorMask(_e,_e,_e,_e),ne=_e)},setLocked:function(_e){O=_e},setClear:function(_e,Se,Ge,Ke,le){le===!0&&(_e*=Ke,Se*=Ke,Ge*=Ke),re.set(_e,Se,Ge,Ke),Ee.equals(re)===!1&&(n.clearColor(_e,Se,Ge,Ke),Ee.copy(re))},reset:function(){O=!1,ne=null,Ee.set(-1,0,0,0)}}}function i(){let O=!1,re=!1,ne=null,Ee=null,_e=null;return{setReversed:function(Se){if(re!==Se){let Ge=e.get("EXT_clip_control");Se?Ge.clipControlEXT(Ge.LOWER_LEFT_EXT,Ge.ZERO_TO_ONE_EXT):Ge.clipControlEXT(Ge.LOWER_LEFT_EXT,Ge.NEGATIVE_ONE_TO_ONE_EXT),re=Se;let Ke=_e;_e=null,this.setClear(Ke)}},getReversed:function(){return re},setTest:function(Se){Se?Me(n.DEPTH_TEST):We(n.DEPTH_TEST)},setMask:function(Se){ne!==Se&&!O&&(n.depthMask(Se),ne=Se)},setFunc:function(Se){if(re&&(Se=Rv[Se]),Ee!==Se){switch(Se){case mh:n.depthFunc(n.NEVER);break;case Xa:n.depthFunc(n.ALWAYS);break;case gh:n.depthFunc(n.LESS);break;case qa:n.depthFunc(n.LEQUAL);break;case _h:n.depthFunc(n.EQUAL);break;case vh:n.depthFunc(n.GEQUAL);break;case yh:n.depthFunc(n.GREATER);break;case xh:n.depthFunc(n.NOTEQUAL);break;default:n.depthFunc(n.LEQUAL)}Ee=Se}},setLocked:function(Se){O=Se},setClear:function(Se){_e!==Se&&(_e=Se,re&&(Se=1-Se),n.clearDepth(Se))},reset:function(){O=!1,ne=null,Ee=null,_e=null,re=!1}}}function s(){let O=!1,re=null,ne=null,Ee=null,_e=null,Se=null,Ge=null,Ke=null,le=null;return{setTest:function(ke){O||(ke?Me(n.STENCIL_TEST):We(n.STENCIL_TEST))},setMask:function(ke){re!==ke&&!O&&(n.stencilMask(ke),re=ke)},setFunc:function(ke,Qe,Re){(ne!==ke||Ee!==Qe||_e!==Re)&&(n.stencilFunc(ke,Qe,Re),ne=ke,Ee=Qe,_e=Re)},setOp:function(ke,Qe,Re){(Se!==ke||Ge!==Qe||Ke!==Re)&&(n.stencilOp(ke,Qe,Re),Se=ke,Ge=Qe,Ke=Re)},setLocked:function(ke){O=ke},setClear:function(ke){le!==ke&&(n.clearStencil(ke),le=ke)},reset:function(){O=!1,re=null,ne=null,Ee=null,_e=null,Se=null,Ge=null,Ke=null,le=null}}}let r=new t,o=new i,a=new s,l={},c=new WeakMap,u={},h={},d={},f=new WeakMap,m=[],y=null,g=!1,p=null,x=null,T=null,b=null,R=null,A=null,v=null,E=new lt(0,0,0),k=0,U=!1,I=null,z=null,H=null,N=null,G=null,Y=n.getParameter(n.MAX_COMBINED_TEXTURE_IMAGE_UNITS),W=!1,ce=0,J=n.getParameter(n.VERSION);J.indexOf("WebGL")!==-1?(ce=parseFloat(/^WebGL (\d)/.exec(J)[1]),W=ce>=1):J.indexOf("OpenGL ES")!==-1&&(ce=parseFloat(/^OpenGL ES (\d)/.exec(J)[1]),W=ce>=2);let Q=null,se={},de=n.getParameter(n.SCISSOR_BOX),he=n.getParameter(n.VIEWPORT),ee=new It().fromArray(de),ge=new It().fromArray(he);function ye(O,re,ne,Ee){let _e=new Uint8Array(4),Se=n.createTexture();n.bindTexture(O,Se),n.texParameteri(O,n.TEXTURE_MIN_FILTER,n.NEAREST),n.texParameteri(O,n.TEXTURE_MAG_FILTER,n.NEAREST);for(let Ge=0;Ge<ne;Ge++)O===n.TEXTURE_3D||O===n.TEXTURE_2D_ARRAY?n.texImage3D(re,0,n.RGBA,1,1,Ee,0,n.RGBA,n.UNSIGNED_BYTE,_e):n.texImage2D(re+Ge,0,n.RGBA,1,1,0,n.RGBA,n.UNSIGNED_BYTE,_e);return Se}let Ce={};Ce[n.TEXTURE_2D]=ye(n.TEXTURE_2D,n.TEXTURE_2D,1),Ce[n.TEXTURE_CUBE_MAP]=ye(n.TEXTURE_CUBE_MAP,n.TEXTURE_CUBE_MAP_POSITIVE_X,6),Ce[n.TEXTURE_2D_ARRAY]=ye(n.TEXTURE_2D_ARRAY,n.TEXTURE_2D_ARRAY,1,1),Ce[n.TEXTURE_3D]=ye(n.TEXTURE_3D,n.TEXTURE_3D,1,1),r.setClear(0,0,0,1),o.setClear(1),a.setClear(0),Me(n.DEPTH_TEST),o.setFunc(qa),bn(!1),Bt(im),Me(n.CULL_FACE),nn(Vo);function Me(O){u[O]!==!0&&(n.enable(O),u[O]=!0)}function We(O){u[O]!==!1&&(n.disable(O),u[O]=!1)}function rt(O,re){return d[O]!==re?(n.bindFramebuffer(O,re),d[O]=re,O===n.DRAW_FRAMEBUFFER&&(d[n.FRAMEBUFFER]=re),O===n.FRAMEBUFFER&&(d[n.DRAW_FRAMEBUFFER]=re),!0):!1}function $e(O,re){let ne=m,Ee=!1;if(O){ne=f.get(re),ne===void 0&&(ne=[],f.set(re,ne));let _e=O.textures;if(ne.length!==_e.length||ne[0]!==n.COLOR_ATTACHMENT0){for(let Se=0,Ge=_e.length;Se<Ge;Se++)ne[Se]=n.COLOR_ATTACHMENT0+Se;ne.length=_e.length,Ee=!0}}else ne[0]!==n.BACK&&(ne[0]=n.BACK,Ee=!0);Ee&&n.drawBuffers(ne)}function mt(O){return y!==O?(n.useProgram(O),y=O,!0):!1}let dt={[Ho]:n.FUNC_ADD,[K_]:n.FUNC_SUBTRACT,[Q_]:n.FUNC_REVERSE_SUBTRACT};dt[ev]=n.MIN,dt[tv]=n.MAX;let it={[nv]:n.ZERO,[iv]:n.ONE,[sv]:n.SRC_COLOR,[am]:n.SRC_ALPHA,[uv]:n.SRC_ALPHA_SATURATE,[lv]:n.DST_COLOR,[ov]:n.DST_ALPHA,[rv]:n.ONE_MINUS_SRC_COLOR,[lm]:n.ONE_MINUS_SRC_ALPHA,[cv]:n.ONE_MINUS_DST_COLOR,[av]:n.ONE_MINUS_DST_ALPHA,[hv]:n.CONSTANT_COLOR,[dv]:n.ONE_MINUS_CONSTANT_COLOR,[fv]:n.CONSTANT_ALPHA,[pv]:n.ONE_MINUS_CONSTANT_ALPHA};function nn(O,re,ne,Ee,_e,Se,Ge,Ke,le,ke){if(O===Vo){g===!0&&(We(n.BLEND),g=!1);return}if(g===!1&&(Me(n.BLEND),g=!0),O!==J_){if(O!==p||ke!==U){if((x!==Ho||R!==Ho)&&(n.blendEquation(n.FUNC_ADD),x=Ho,R=Ho),ke)switch(O){case il:n.blendFuncSeparate(n.ONE,n.ONE_MINUS_SRC_ALPHA,n.ONE,n.ONE_MINUS_SRC_ALPHA);break;case sm:n.blendFunc(n.ONE,n.ONE);break;case rm:n.blendFuncSeparate(n.ZERO,n.ONE_MINUS_SRC_COLOR,n.ZERO,n.ONE);break;case om:n.blendFuncSeparate(n.DST_COLOR,n.ONE_MINUS_SRC_ALPHA,n.ZERO,n.ONE);break;default:tt("WebGLState: Invalid blending: ",O);break}else switch(O){case il:n.blendFuncSeparate(n.SRC_ALPHA,n.ONE_MINUS_SRC_ALPHA,n.ONE,n.ONE_MINUS_SRC_ALPHA);break;case sm:n.blendFuncSeparate(n.SRC_ALPHA,n.ONE,n.ONE,n.ONE);break;case rm:tt("WebGLState: SubtractiveBlending requires material.premultipliedAlpha = true");break;case om:tt("WebGLState: MultiplyBlending requires material.premultipliedAlpha = true");break;default:tt("WebGLState: Invalid blending: ",O);break}T=null,b=null,A=null,v=null,E.set(0,0,0),k=0,p=O,U=ke}return}_e=_e||re,Se=Se||ne,Ge=Ge||Ee,(re!==x||_e!==R)&&(n.blendEquationSeparate(dt[re],dt[_e]),x=re,R=_e),(ne!==T||Ee!==b||Se!==A||Ge!==v)&&(n.blendFuncSeparate(it[ne],it[Ee],it[Se],it[Ge]),T=ne,b=Ee,A=Se,v=Ge),(Ke.equals(E)===!1||le!==k)&&(n.blendColor(Ke.r,Ke.g,Ke.b,le),E.copy(Ke),k=le),p=O,U=!1}function qt(O,re){O.side===os?We(n.CULL_FACE):Me(n.CULL_FACE);let ne=O.side===Ci;re&&(ne=!ne),bn(ne),O.blending===il&&O.transparent===!1?nn(Vo):nn(O.blending,O.blendEquation,O.blendSrc,O.blendDst,O.blendEquationAlpha,O.blendSrcAlpha,O.blendDstAlpha,O.blendColor,O.blendAlpha,O.premultipliedAlpha),o.setFunc(O.depthFunc),o.setTest(O.depthTest),o.setMask(O.depthWrite),r.setMask(O.colorWrite);let Ee=O.stencilWrite;a.setTest(Ee),Ee&&(a.setMask(O.stencilWriteMask),a.setFunc(O.stencilFunc,O.stencilRef,O.stencilFuncMask),a.setOp(O.stencilFail,O.stencilZFail,O.stencilZPass)),Mt(O.polygonOffset,O.polygonOffsetFactor,O.polygonOffsetUnits),O.alphaToCoverage===!0?Me(n.SAMPLE_ALPHA_TO_COVERAGE):We(n.SAMPLE_ALPHA_TO_COVERAGE)}function bn(O){I!==O&&(O?n.frontFace(n.CW):n.frontFace(n.CCW),I=O)}function Bt(O){O!==Y_?(Me(n.CULL_FACE),O!==z&&(O===im?n.cullFace(n.BACK):O===j_?n.cullFace(n.FRONT):n.cullFace(n.FRONT_AND_BACK))):We(n.CULL_FACE),z=O}function Gn(O){O!==H&&(W&&n.lineWidth(O),H=O)}function Mt(O,re,ne){O?(Me(n.POLYGON_OFFSET_FILL),(N!==re||G!==ne)&&(N=re,G=ne,o.getReversed()&&(re=-re,ne=-ne),n.polygonOffset(re,ne))):We(n.POLYGON_OFFSET_FILL)}function Nn(O){O?Me(n.SCISSOR_TEST):We(n.SCISSOR_TEST)}function ln(O){O===void 0&&(O=n.TEXTURE0+Y-1),Q!==O&&(n.activeTexture(O),Q=O)}function Sn(O,re,ne){ne===void 0&&(Q===null?ne=n.TEXTURE0+Y-1:ne=Q);let Ee=se[ne];Ee===void 0&&(Ee={type:void 0,texture:void 0},se[ne]=Ee),(Ee.type!==O||Ee.texture!==re)&&(Q!==ne&&(n.activeTexture(ne),Q=ne),n.bindTexture(O,re||Ce[O]),Ee.type=O,Ee.texture=re)}function F(){let O=se[Q];O!==void 0&&O.type!==void 0&&(n.bindTexture(O.type,null),O.type=void 0,O.texture=void 0)}function Pe(){try{n.compressedTexImage2D(...arguments)}catch(O){tt("WebGLState:",O)}}function Ye(){try{n.compressedTexImage3D(...arguments)}catch(O){tt("WebGLState:",O)}}function ot(){try{n.texSubImage2D(...arguments)}catch(O){tt("WebGLState:",O)}}function we(){try{n.texSubImage3D(...arguments)}catch(O){tt("WebGLState:",O)}}function Ht(){try{n.compressedTexSubImage2D(...arguments)}catch(O){tt("WebGLState:",O)}}function He(){try{n.compressedTexSubImage3D(...arguments)}catch(O){tt("WebGLState:",O)}}function qe(){try{n.texStorage2D(...arguments)}catch(O){tt("WebGLState:",O)}}function C(){try{n.texStorage3D(...arguments)}catch(O){tt("WebGLState:",O)}}function S(){try{n.texImage2D(...arguments)}catch(O){tt("WebGLState:",O)}}function X(){try{n.texImage3D(...arguments)}catch(O){tt("WebGLState:",O)}}function ue(O){return h[O]!==void 0?h[O]:n.getParameter(O)}function oe(O,re){h[O]!==re&&(n.pixelStorei(O,re),h[O]=re)}function ve(O){ee.equals(O)===!1&&(n.scissor(O.x,O.y,O.z,O.w),ee.copy(O))}function xe(O){ge.equals(O)===!1&&(n.viewport(O.x,O.y,O.z,O.w),ge.copy(O))}function te(O,re){let ne=c.get(re);ne===void 0&&(ne=new WeakMap,c.set(re,ne));let Ee=ne.get(O);Ee===void 0&&(Ee=n.getUniformBlockIndex(re,O.name),n.uniformBlockBinding(re,Ee,Ee),ne.set(O,Ee))}function ie(O,re,ne){let _e=c.get(re).get(O);l[_e]!==ne&&(n.bindBufferBase(n.UNIFORM_BUFFER,_e,ne),l[_e]=ne)}function me(){n.disable(n.BLEND),n.disable(n.CULL_FACE),n.disable(n.DEPTH_TEST),n.disable(n.POLYGON_OFFSET_FILL),n.disable(n.SCISSOR_TEST),n.disable(n.STENCIL_TEST),n.disable(n.SAMPLE_ALPHA_TO_COVERAGE),n.blendEquation(n.FUNC_ADD),n.blendFunc(n.ONE,n.ZERO),n.blendFuncSeparate(n.ONE,n.ZERO,n.ONE,n.ZERO),n.blendColor(0,0,0,0),n.colorMask(!0,!0,!0,!0),n.clearColor(0,0,0,0),n.depthMask(!0),n.depthFunc(n.LESS),o.setReversed(!1),n.clearDepth(1),n.stencilMask(4294967295),n.stencilFunc(n.ALWAYS,0,4294967295),n.stencilOp(n.KEEP,n.KEEP,n.KEEP),n.clearStencil(0),n.cullFace(n.BACK),n.frontFace(n.CCW),n.polygonOffset(0,0),n.activeTexture(n.TEXTURE0),n.bindFramebuffer(n.FRAMEBUFFER,null),n.bindFramebuffer(n.DRAW_FRAMEBUFFER,null),n.bindFramebuffer(n.READ_FRAMEBUFFER,null),n.useProgram(null),n.lineWidth(1),n.scissor(0,0,n.canvas.width,n.canvas.height),n.viewport(0,0,n.canvas.width,n.canvas.height),n.pixelStorei(n.PACK_ALIGNMENT,4),n.pixelStorei(n.UNPACK_ALIGNMENT,4),n.pixelStorei(n.UNPACK_FLIP_Y_WEBGL,!1),n.pixelStorei(n.UNPACK_PREMULTIPLY_ALPHA_WEBGL,!1),n.pixelStorei(n.UNPACK_COLORSPACE_CONVERSION_WEBGL,n.BROWSER_DEFAULT_WEBGL),n.pixelStorei(n.PACK_ROW_LENGTH,0),n.pixelStorei(n.PACK_SKIP_PIXELS,0),n.pixelStorei(n.PACK_SKIP_ROWS,0),n.pixelStorei(n.UNPACK_ROW_LENGTH,0),n.pixelStorei(n.UNPACK_IMAGE_HEIGHT,0),n.pixelStorei(n.UNPACK_SKIP_PIXELS,0),n.pixelStorei(n.UNPACK_SKIP_ROWS,0),n.pixelStorei(n.UNPACK_SKIP_IMAGES,0),u={},h={},Q=null,se={},d={},l={},f=new WeakMap,m=[],y=null,g=!1,p=null,x=null,T=null,b=null,R=null,A=null,v=null,E=new lt(0,0,0),k=0,U=!1,I=null,z=null,H=null,N=null,G=null,ee.set(0,0,n.canvas.width,n.canvas.height),ge.set(0,0,n.canvas.width,n.canvas.height),r.reset(),o.reset(),a.reset()}return{buffers:{color:r,depth:o,stencil:a},enable:Me,disable:We,bindFramebuffer:rt,drawBuffers:$e,useProgram:mt,setBlending:nn,setMaterial:qt,setFlipSided:bn,setCullFace:Bt,setLineWidth:Gn,setPolygonOffset:Mt,setScissorTest:Nn,activeTexture:ln,bindTexture:Sn,unbindTexture:F,compressedTexImage2D:Pe,compressedTexImage3D:Ye,texImage2D:S,texImage3D:X,pixelStorei:oe,getParameter:ue,updateUBOMapping:te,uniformBlockBinding:ie,texStorage2D:qe,texStorage3D:C,texSubImage2D:ot,texSubImage3D:we,compressedTexSubImage2D:Ht,compressedTexSubImage3D:He,scissor:ve,viewport:xe,reset:me}}function vC(n,e,t,i,s,r,o){let a=e.has("WEBGL_multisampled_render_to_texture")?e.get("WEBGL_multisampled_render_to_texture"):null,l=typeof navigator>"u"?!1:/OculusBrowser/g.test(navigator.userAgent),c=new at,u=new WeakMap,h=new Set,d,f=new WeakMap,m=new Set,y=new FinalizationRegistry(C=>m.delete(C)),g=!1;try{g=typeof OffscreenCanvas<"u"&&new OffscreenCanvas(1,1).getContext("2d")!==null}catch{}function p(C,S){return g?new OffscreenCanvas(C,S):fc("canvas")}function x(C,S,X){let ue=1,oe=qe(C);if((oe.width>X||oe.height>X)&&(ue=X/Math.max(oe.width,oe.height)),ue<1)if(typeof HTMLImageElement<"u"&&C instanceof HTMLImageElement||typeof HTMLCanvasElement<"u"&&C instanceof HTMLCanvasElement||typeof ImageBitmap<"u"&&C instanceof ImageBitmap||typeof VideoFrame<"u"&&C instanceof VideoFrame){let ve=Math.floor(ue*oe.width),xe=Math.floor(ue*oe.height);d===void 0&&(d=p(ve,xe));let te=S?p(ve,xe):d;return te.width=ve,te.height=xe,te.getContext("2d").drawImage(C,0,0,ve,xe),Ze("WebGLRenderer: Texture has been resized from ("+oe.width+"x"+oe.height+") to ("+ve+"x"+xe+")."),te}else return"data"in C&&Ze("WebGLRenderer: Image in DataTexture is too big ("+oe.width+"x"+oe.height+")."),C;return C}function T(C){return C.generateMipmaps}function b(C){n.generateMipmap(C)}function R(C){return C.isWebGLCubeRenderTarget?n.TEXTURE_CUBE_MAP:C.isWebGL3DRenderTarget?n.TEXTURE_3D:C.isWebGLArrayRenderTarget||C.isCompressedArrayTexture?n.TEXTURE_2D_ARRAY:n.TEXTURE_2D}function A(C,S,X,ue,oe,ve=!1){if(C!==null){if(n[C]!==void 0)return n[C];Ze("WebGLRenderer: Attempt to use non-existing WebGL internal format '"+C+"'")}let xe;ue&&(xe=e.get("EXT_texture_norm16"),xe||Ze("WebGLRenderer: Unable to use normalized textures without EXT_texture_norm16 extension"));let te=S;if(S===n.RED&&(X===n.FLOAT&&(te=n.R32F),X===n.HALF_FLOAT&&(te=n.R16F),X===n.UNSIGNED_BYTE&&(te=n.R8),X===n.UNSIGNED_SHORT&&xe&&(te=xe.R16_EXT),X===n.SHORT&&xe&&(te=xe.R16_SNORM_EXT)),S===n.RED_INTEGER&&(X===n.UNSIGNED_BYTE&&(te=n.R8UI),X===n.UNSIGNED_SHORT&&(te=n.R16UI),X===n.UNSIGNED_INT&&(te=n.R32UI),X===n.BYTE&&(te=n.R8I),X===n.SHORT&&(te=n.R16I),X===n.INT&&(te=n.R32I)),S===n.RG&&(X===n.FLOAT&&(te=n.RG32F),X===n.HALF_FLOAT&&(te=n.RG16F),X===n.UNSIGNED_BYTE&&(te=n.RG8),X===n.UNSIGNED_SHORT&&xe&&(te=xe.RG16_EXT),X===n.SHORT&&xe&&(te=xe.RG16_SNORM_EXT)),S===n.RG_INTEGER&&(X===n.UNSIGNED_BYTE&&(te=n.RG8UI),X===n.UNSIGNED_SHORT&&(te=n.RG16UI),X===n.UNSIGNED_INT&&(te=n.RG32UI),X===n.BYTE&&(te=n.RG8I),X===n.SHORT&&(te=n.RG16I),X===n.INT&&(te=n.RG32I)),S===n.RGB_INTEGER&&(X===n.UNSIGNED_BYTE&&(te=n.RGB8UI),X===n.UNSIGNED_SHORT&&(te=n.RGB16UI),X===n.UNSIGNED_INT&&(te=n.RGB32UI),X===n.BYTE&&(te=n.RGB8I),X===n.SHORT&&(te=n.RGB16I),X===n.INT&&(te=n.RGB32I)),S===n.RGBA_INTEGER&&(X===n.UNSIGNED_BYTE&&(te=n.RGBA8UI),X===n.UNSIGNED_SHORT&&(te=n.RGBA16UI),X===n.UNSIGNED_INT&&(te=n.RGBA32UI),X===n.BYTE&&(te=n.RGBA8I),X===n.SHORT&&(te=n.RGBA16I),X===n.INT&&(te=n.RGBA32I)),S===n.RGB&&(X===n.UNSIGNED_SHORT&&xe&&(te=xe.RGB16_EXT),X===n.SHORT&&xe&&(te=xe.RGB16_SNORM_EXT),X===n.UNSIGNED_INT_5_9_9_9_REV&&(te=n.RGB9_E5),X===n.UNSIGNED_INT_10F_11F_11F_REV&&(te=n.R11F_G11F_B10F)),S===n.RGBA){let ie=ve?dc:vt.getTransfer(oe);X===n.FLOAT&&(te=n.RGBA32F),X===n.HALF_FLOAT&&(te=n.RGBA16F),X===n.UNSIGNED_BYTE&&(te=ie===Pt?n.SRGB8_ALPHA8:n.RGBA8),X===n.UNSIGNED_SHORT&&xe&&(te=xe.RGBA16_EXT),X===n.SHORT&&xe&&(te=xe.RGBA16_SNORM_EXT),X===n.UNSIGNED_SHORT_4_4_4_4&&(te=n.RGBA4),X===n.UNSIGNED_SHORT_5_5_5_1&&(te=n.RGB5_A1)}return(te===n.R16F||te===n.R32F||te===n.RG16F||te===n.RG32F||te===n.RGBA16F||te===n.RGBA32F)&&e.get("EXT_color_buffer_float"),te}function v(C,S){let X;return C?S===null||S===Ts||S===Go?X=n.DEPTH24_STENCIL8:S===Oi?X=n.DEPTH32F_STENCIL8:S===rl&&(X=n.DEPTH24_STENCIL8,Ze("DepthTexture: 16 bit depth attachment is not supported with stencil. Using 24-bit attachment.")):S===null||S===Ts||S===Go?X=n.DEPTH_COMPONENT24:S===Oi?X=n.DEPTH_COMPONENT32F:S===rl&&(X=n.DEPTH_COMPONENT16),X}function E(C,S){return T(C)===!0||C.isFramebufferTexture&&C.minFilter!==Rn&&C.minFilter!==Ti?Math.log2(Math.max(S.width,S.height))+1:C.mipmaps.length>0?C.mipmaps.length:C.isCompressedTexture&&Array.isArray(C.image)?S.mipmaps.length:1}function k(C){let S=new WeakRef(C);i.get(C).__ref=S,m.add(S),y.register(C,S,S)}function U(C){let S=i.get(C).__ref;S!==void 0&&(m.delete(S),y.unregister(S))}function I(C){H(C.target)}function z(C){N(C.target)}function H(C){C.removeEventListener("dispose",I),U(C),Y(C),C.isVideoTexture&&u.delete(C),C.isHTMLTexture&&h.delete(C)}function N(C){C.removeEventListener("dispose",z),U(C),ce(C)}function G(){for(let C of m){let S=C.deref();S!==void 0&&(S.isRenderTarget===!0?N(S):H(S))}m.clear(),h.clear()}function Y(C){let S=i.get(C);if(S.__webglInit===void 0)return;let X=C.source,ue=f.get(X);if(ue){let oe=ue[S.__cacheKey];oe.usedTimes--,oe.usedTimes===0&&W(C),Object.keys(ue).length===0&&f.delete(X)}i.remove(C)}function W(C){let S=i.get(C);n.deleteTexture(S.__webglTexture);let X=C.source,ue=f.get(X);delete ue[S.__cacheKey],o.memory.textures--}function ce(C){let S=i.get(C);S.__depthDisposeCallback&&S.__depthDisposeCallback();let X=C.depthTexture;if(X&&X.renderTarget===C&&H(X),C.isWebGLCubeRenderTarget)for(let oe=0;oe<6;oe++){if(Array.isArray(S.__webglFramebuffer[oe]))for(let ve=0;ve<S.__webglFramebuffer[oe].length;ve++)n.deleteFramebuffer(S.__webglFramebuffer[oe][ve]);else n.deleteFramebuffer(S.__webglFramebuffer[oe]);S.__webglDepthbuffer&&n.deleteRenderbuffer(S.__webglDepthbuffer[oe])}else{if(Array.isArray(S.__webglFramebuffer))for(let oe=0;oe<S.__webglFramebuffer.length;oe++)n.deleteFramebuffer(S.__webglFramebuffer[oe]);else n.deleteFramebuffer(S.__webglFramebuffer);if(S.__webglDepthbuffer&&n.deleteRenderbuffer(S.__webglDepthbuffer),S.__webglMultisampledFramebuffer&&n.deleteFramebuffer(S.__webglMultisampledFramebuffer),S.__webglColorRenderbuffer)for(let oe=0;oe<S.__webglColorRenderbuffer.length;oe++)S.__webglColorRenderbuffer[oe]&&n.deleteRenderbuffer(S.__webglColorRenderbuffer[oe]);S.__webglDepthRenderbuffer&&n.deleteRenderbuffer(S.__webglDepthRenderbuffer)}let ue=C.textures;for(let oe=0,ve=ue.length;oe<ve;oe++){let xe=i.get(ue[oe]);xe.__webglTexture&&(n.deleteTexture(xe.__webglTexture),o.memory.textures--),i.remove(ue[oe])}i.remove(C)}let J=0;function Q(){J=0}function se(){return J}function de(C){J=C}function he(){let C=J;return C>=s.maxTextures&&Ze("WebGLTextures: Trying to use "+(C+1)+" texture units while this GPU supports only "+s.maxTextures),J+=1,C}function ee(C){let S=[];return S.push(C.wrapS),S.push(C.wrapT),S.push(C.wrapR||0),S.push(C.magFilter),S.push(C.minFilter),S.push(C.anisotropy),S.push(C.internalFormat),S.push(C.format),S.push(C.type),S.push(C.generateMipmaps),S.push(C.mipmapsAutoUpdate),S.push(C.premultiplyAlpha),S.push(C.flipY),S.push(C.unpackAlignment),S.push(C.colorSpace),S.join()}function ge(C,S){let X=i.get(C);if(C.isVideoTexture&&Ht(C),C.isRenderTargetTexture===!1&&C.isExternalTexture!==!0&&C.version>0&&X.__version!==C.version){let ue=C.image;if(ue===null)Ze("WebGLRenderer: Texture marked for update but no image data found.");else if(ue.complete===!1)Ze("WebGLRenderer: Texture marked for update but image is incomplete");else{qt(X,C,S);return}}else C.isExternalTexture&&(X.__webglTexture=C.sourceTexture?C.sourceTexture:null);t.bindTexture(n.TEXTURE_2D,X.__webglTexture,n.TEXTURE0+S)}function ye(C,S){let X=i.get(C);if(C.isRenderTargetTexture===!1&&C.version>0&&X.__version!==C.version){qt(X,C,S);return}else C.isExternalTexture&&(X.__webglTexture=C.sourceTexture?C.sourceTexture:null);t.bindTexture(n.TEXTURE_2D_ARRAY,X.__webglTexture,n.TEXTURE0+S)}function Ce(C,S){let X=i.get(C);if(C.isRenderTargetTexture===!1&&C.version>0&&X.__version!==C.version){qt(X,C,S);return}t.bindTexture(n.TEXTURE_3D,X.__webglTexture,n.TEXTURE0+S)}function Me(C,S){let X=i.get(C);if(C.version>0&&X.__version!==C.version){bn(X,C,S);return}t.bindTexture(n.TEXTURE_CUBE_MAP,X.__webglTexture,n.TEXTURE0+S)}let We={[bh]:n.REPEAT,[Vs]:n.CLAMP_TO_EDGE,[Sh]:n.MIRRORED_REPEAT},rt={[Rn]:n.NEAREST,[_v]:n.NEAREST_MIPMAP_NEAREST,[Fc]:n.NEAREST_MIPMAP_LINEAR,[Ti]:n.LINEAR,[jh]:n.LINEAR_MIPMAP_NEAREST,[br]:n.LINEAR_MIPMAP_LINEAR},$e={[bv]:n.NEVER,[Em]:n.ALWAYS,[Sv]:n.LESS,[Mm]:n.LEQUAL,[Mv]:n.EQUAL,[wm]:n.GEQUAL,[wv]:n.GREATER,[Ev]:n.NOTEQUAL};function mt(C,S){if(S.type===Oi&&e.has("OES_texture_float_linear")===!1&&(S.magFilter===Ti||S.magFilter===jh||S.magFilter===Fc||S.magFilter===br||S.minFilter===Ti||S.minFilter===jh||S.minFilter===Fc||S.minFilter===br)&&Ze("WebGLRenderer: Unable to use linear filtering with floating point textures. OES_texture_float_linear not supported on this device."),n.texParameteri(C,n.TEXTURE_WRAP_S,We[S.wrapS]),n.texParameteri(C,n.TEXTURE_WRAP_T,We[S.wrapT]),(C===n.TEXTURE_3D||C===n.TEXTURE_2D_ARRAY)&&n.texParameteri(C,n.TEXTURE_WRAP_R,We[S.wrapR]),n.texParameteri(C,n.TEXTURE_MAG_FILTER,rt[S.magFilter]),n.texParameteri(C,n.TEXTURE_MIN_FILTER,rt[S.minFilter]),S.compareFunction&&(n.texParameteri(C,n.TEXTURE_COMPARE_MODE,n.COMPARE_REF_TO_TEXTURE),n.texParameteri(C,n.TEXTURE_COMPARE_FUNC,$e[S.compareFunction])),e.has("EXT_texture_filter_anisotropic")===!0){if(S.magFilter===Rn||S.minFilter!==Fc&&S.minFilter!==br||S.type===Oi&&e.has("OES_texture_float_linear")===!1)return;if(S.anisotropy>1||i.get(S).__currentAnisotropy){let X=e.get("EXT_texture_filter_anisotropic");n.texParameterf(C,X.TEXTURE_MAX_ANISOTROPY_EXT,Math.min(S.anisotropy,s.getMaxAnisotropy())),i.get(S).__currentAnisotropy=S.anisotropy}}}function dt(C,S){let X=!1;C.__webglInit===void 0&&(C.__webglInit=!0,S.addEventListener("dispose",I),k(S));let ue=S.source,oe=f.get(ue);oe===void 0&&(oe={},f.set(ue,oe));let ve=ee(S);if(ve!==C.__cacheKey){oe[ve]===void 0&&(oe[ve]={texture:n.createTexture(),usedTimes:0},o.memory.textures++,X=!0),oe[ve].usedTimes++;let xe=oe[C.__cacheKey];xe!==void 0&&(oe[C.__cacheKey].usedTimes--,xe.usedTimes===0&&W(S)),C.__cacheKey=ve,C.__webglTexture=oe[ve].texture}return X}function it(C,S,X){return Math.floor(Math.floor(C/X)/S)}function nn(C,S,X,ue){let ve=C.updateRanges;if(ve.length===0)t.texSubImage2D(n.TEXTURE_2D,0,0,0,S.width,S.height,X,ue,S.data);else{ve.sort((O,re)=>O.start-re.start);let xe=0;for(let O=1;O<ve.length;O++){let re=ve[xe],ne=ve[O],Ee=re.start+re.count,_e=it(ne.start,S.width,4),Se=it(re.start,S.width,4);ne.start<=Ee+1&&_e===Se&&it(ne.start+ne.count-1,S.width,4)===_e?re.count=Math.max(re.count,ne.start+ne.count-re.start):(++xe,ve[xe]=ne)}ve.length=xe+1;let te=t.getParameter(n.UNPACK_ROW_LENGTH),ie=t.getParameter(n.UNPACK_SKIP_PIXELS),me=t.getParameter(n.UNPACK_SKIP_ROWS);t.pixelStorei(n.UNPACK_ROW_LENGTH,S.width);for(let O=0,re=ve.length;O<re;O++){let ne=ve[O],Ee=Math.floor(ne.start/4),_e=Math.ceil(ne.count/4),Se=Ee%S.width,Ge=Math.floor(Ee/S.width),Ke=_e,le=1;t.pixelStorei(n.UNPACK_SKIP_PIXELS,Se),t.pixelStorei(n.UNPACK_SKIP_ROWS,Ge),t.texSubImage2D(n.TEXTURE_2D,0,Se,Ge,Ke,le,X,ue,S.data)}C.clearUpdateRanges(),t.pixelStorei(n.UNPACK_ROW_LENGTH,te),t.pixelStorei(n.UNPACK_SKIP_PIXELS,ie),t.pixelStorei(n.UNPACK_SKIP_ROWS,me)}}function qt(C,S,X){let ue=n.TEXTURE_2D;(S.isDataArrayTexture||S.isCompressedArrayTexture)&&(ue=n.TEXTURE_2D_ARRAY),S.isData3DTexture&&(ue=n.TEXTURE_3D);let oe=dt(C,S),ve=S.source;t.bindTexture(ue,C.__webglTexture,n.TEXTURE0+X);let xe=i.get(ve);if(ve.version!==xe.__version||oe===!0){if(t.activeTexture(n.TEXTURE0+X),(typeof ImageBitmap<"u"&&S.image instanceof ImageBitmap)===!1){let le=vt.getPrimaries(vt.workingColorSpace),ke=S.colorSpace===Mr?null:vt.getPrimaries(S.colorSpace),Qe=S.colorSpace===Mr||le===ke?n.NONE:n.BROWSER_DEFAULT_WEBGL;t.pixelStorei(n.UNPACK_FLIP_Y_WEBGL,S.flipY),t.pixelStorei(n.UNPACK_PREMULTIPLY_ALPHA_WEBGL,S.premultiplyAlpha),t.pixelStorei(n.UNPACK_COLORSPACE_CONVERSION_WEBGL,Qe)}t.pixelStorei(n.UNPACK_ALIGNMENT,S.unpackAlignment);let ie=x(S.image,!1,s.maxTextureSize);ie=He(S,ie);let me=r.convert(S.format,S.colorSpace),O=r.convert(S.type),re=A(S.internalFormat,me,O,S.normalized,S.colorSpace,S.isVideoTexture);mt(ue,S);let ne,Ee=S.mipmaps,_e=S.isVideoTexture!==!0,Se=xe.__version===void 0||oe===!0,Ge=ve.dataReady,Ke=E(S,ie);if(S.isDepthTexture)re=v(S.format===Sr,S.type),Se&&(_e?t.texStorage2D(n.TEXTURE_2D,1,re,ie.width,ie.height):t.texImage2D(n.TEXTURE_2D,0,re,ie.width,ie.height,0,me,O,null));else if(S.isDataTexture)if(Ee.length>0){_e&&Se&&t.texStorage2D(n.TEXTURE_2D,Ke,re,Ee[0].width,Ee[0].height);for(let le=0,ke=Ee.length;le<ke;le++)ne=Ee[le],_e?Ge&&t.texSubImage2D(n.TEXTURE_2D,le,0,0,ne.width,ne.height,me,O,ne.data):t.texImage2D(n.TEXTURE_2D,le,re,ne.width,ne.height,0,me,O,ne.data);S.generateMipmaps=!1}else _e?(Se&&t.texStorage2D(n.TEXTURE_2D,Ke,re,ie.width,ie.height),Ge&&nn(S,ie,me,O)):t.texImage2D(n.TEXTURE_2D,0,re,ie.width,ie.height,0,me,O,ie.data);else if(S.isCompressedTexture)if(S.isCompressedArrayTexture){_e&&Se&&t.texStorage3D(n.TEXTURE_2D_ARRAY,Ke,re,Ee[0].width,Ee[0].height,ie.depth);for(let le=0,ke=Ee.length;le<ke;le++)if(ne=Ee[le],S.format!==Yi)if(me!==null)if(_e){if(Ge)if(S.layerUpdates.size>0){let Qe=Um(ne.width,ne.height,S.format,S.type);for(let Re of S.layerUpdates){let ct=ne.data.subarray(Re*Qe/ne.data.BYTES_PER_ELEMENT,(Re+1)*Qe/ne.data.BYTES_PER_ELEMENT);t.compressedTexSubImage3D(n.TEXTURE_2D_ARRAY,le,0,0,Re,ne.width,ne.height,1,me,ct)}}else t.compressedTexSubImage3D(n.TEXTURE_2D_ARRAY,le,0,0,0,ne.width,ne.height,ie.depth,me,ne.data)}else t.compressedTexImage3D(n.TEXTURE_2D_ARRAY,le,re,ne.width,ne.height,ie.depth,0,ne.data,0,0);else Ze("WebGLRenderer: Attempt to load unsupported compressed texture format in .uploadTexture()");else _e?Ge&&t.texSubImage3D(n.TEXTURE_2D_ARRAY,le,0,0,0,ne.width,ne.height,ie.depth,me,O,ne.data):t.texImage3D(n.TEXTURE_2D_ARRAY,le,re,ne.width,ne.height,ie.depth,0,me,O,ne.data);S.layerUpdates.size>0&&S.clearLayerUpdates()}else{_e&&Se&&t.texStorage2D(n.TEXTURE_2D,Ke,re,Ee[0].width,Ee[0].height);for(let le=0,ke=Ee.length;le<ke;le++)ne=Ee[le],S.format!==Yi?me!==null?_e?Ge&&t.compressedTexSubImage2D(n.TEXTURE_2D,le,0,0,ne.width,ne.height,me,ne.data):t.compressedTexImage2D(n.TEXTURE_2D,le,re,ne.width,ne.height,0,ne.data):Ze("WebGLRenderer: Attempt to load unsupported compressed texture format in .uploadTexture()"):_e?Ge&&t.texSubImage2D(n.TEXTURE_2D,le,0,0,ne.width,ne.height,me,O,ne.data):t.texImage2D(n.TEXTURE_2D,le,re,ne.width,ne.height,0,me,O,ne.data)}else if(S.isDataArrayTexture)if(_e){if(Se&&t.texStorage3D(n.TEXTURE_2D_ARRAY,Ke,re,ie.width,ie.height,ie.depth),Ge)if(S.layerUpdates.size>0){let le=Um(ie.width,ie.height,S.format,S.type);for(let ke of S.layerUpdates){let Qe=ie.data.subarray(ke*le/ie.data.BYTES_PER_ELEMENT,(ke+1)*le/ie.data.BYTES_PER_ELEMENT);t.texSubImage3D(n.TEXTURE_2D_ARRAY,0,0,0,ke,ie.width,ie.height,1,me,O,Qe)}S.clearLayerUpdates()}else t.texSubImage3D(n.TEXTURE_2D_ARRAY,0,0,0,0,ie.width,ie.height,ie.depth,me,O,ie.data)}else t.texImage3D(n.TEXTURE_2D_ARRAY,0,re,ie.width,ie.height,ie.depth,0,me,O,ie.data);else if(S.isData3DTexture)_e?(Se&&t.texStorage3D(n.TEXTURE_3D,Ke,re,ie.width,ie.height,ie.depth),Ge&&t.texSubImage3D(n.TEXTURE_3D,0,0,0,0,ie.width,ie.height,ie.depth,me,O,ie.data)):t.texImage3D(n.TEXTURE_3D,0,re,ie.width,ie.height,ie.depth,0,me,O,ie.data);else if(S.isFramebufferTexture){if(Se)if(_e)t.texStorage2D(n.TEXTURE_2D,Ke,re,ie.width,ie.height);else{let le=ie.width,ke=ie.height;for(let Qe=0;Qe<Ke;Qe++)t.texImage2D(n.TEXTURE_2D,Qe,re,le,ke,0,me,O,null),le>>=1,ke>>=1}}else if(S.isHTMLTexture){if("texElementImage2D"in n){let le=n.canvas;if(le.hasAttribute("layoutsubtree")||le.setAttribute("layoutsubtree","true"),ie.parentNode!==le){le.appendChild(ie),h.add(S),le.onpaint=ke=>{let Qe=ke.changedElements;for(let Re of h)Qe.includes(Re.image)&&(Re.needsUpdate=!0)},le.requestPaint();return}if(n.texElementImage2D.length===3)n.texElementImage2D(n.TEXTURE_2D,n.RGBA8,ie);else{let Qe=n.RGBA,Re=n.RGBA,ct=n.UNSIGNED_BYTE;n.texElementImage2D(n.TEXTURE_2D,0,Qe,Re,ct,ie)}n.texParameteri(n.TEXTURE_2D,n.TEXTURE_MIN_FILTER,n.LINEAR),n.texParameteri(n.TEXTURE_2D,n.TEXTURE_WRAP_S,n.CLAMP_TO_EDGE),n.texParameteri(n.TEXTURE_2D,n.TEXTURE_WRAP_T,n.CLAMP_TO_EDGE)}}else if(Ee.length>0){if(_e&&Se){let le=qe(Ee[0]);t.texStorage2D(n.TEXTURE_2D,Ke,re,le.width,le.height)}for(let le=0,ke=Ee.length;le<ke;le++)ne=Ee[le],_e?Ge&&t.texSubImage2D(n.TEXTURE_2D,le,0,0,me,O,ne):t.texImage2D(n.TEXTURE_2D,le,re,me,O,ne);S.generateMipmaps=!1}else if(_e){if(Se){let le=qe(ie);t.texStorage2D(n.TEXTURE_2D,Ke,re,le.width,le.height)}Ge&&t.texSubImage2D(n.TEXTURE_2D,0,0,0,me,O,ie)}else t.texImage2D(n.TEXTURE_2D,0,re,me,O,ie);T(S)&&S.mipmapsAutoUpdate===!0&&b(ue),xe.__version=ve.version,S.onUpdate&&S.onUpdate(S)}C.__version=S.version}function bn(C,S,X){if(S.image.length!==6)return;let ue=dt(C,S),oe=S.source;t.bindTexture(n.TEXTURE_CUBE_MAP,C.__webglTexture,n.TEXTURE0+X);let ve=i.get(oe);if(oe.version!==ve.__version||ue===!0){t.activeTexture(n.TEXTURE0+X);let xe=vt.getPrimaries(vt.workingColorSpace),te=S.colorSpace===Mr?null:vt.getPrimaries(S.colorSpace),ie=S.colorSpace===Mr||xe===te?n.NONE:n.BROWSER_DEFAULT_WEBGL;t.pixelStorei(n.UNPACK_FLIP_Y_WEBGL,S.flipY),t.pixelStorei(n.UNPACK_PREMULTIPLY_ALPHA_WEBGL,S.premultiplyAlpha),t.pixelStorei(n.UNPACK_ALIGNMENT,S.unpackAlignment),t.pixelStorei(n.UNPACK_COLORSPACE_CONVERSION_WEBGL,ie);let me=S.isCompressedTexture||S.image[0].isCompressedTexture,O=S.image[0]&&S.image[0].isDataTexture,re=[];for(let Re=0;Re<6;Re++)!me&&!O?re[Re]=x(S.image[Re],!0,s.maxCubemapSize):re[Re]=O?S.image[Re].image:S.image[Re],re[Re]=He(S,re[Re]);let ne=re[0],Ee=r.convert(S.format,S.colorSpace),_e=r.convert(S.type),Se=A(S.internalFormat,Ee,_e,S.normalized,S.colorSpace),Ge=S.isVideoTexture!==!0,Ke=ve.__version===void 0||ue===!0,le=oe.dataReady,ke=E(S,ne);mt(n.TEXTURE_CUBE_MAP,S);let Qe;if(S.isDepthTexture){if(Se=v(S.format===Sr,S.type),Ke)if(Ge)t.texStorage2D(n.TEXTURE_CUBE_MAP,1,Se,ne.width,ne.height);else for(let Re=0;Re<6;Re++)t.texImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+Re,0,Se,ne.width,ne.height,0,Ee,_e,null)}else if(me){Ge&&Ke&&t.texStorage2D(n.TEXTURE_CUBE_MAP,ke,Se,ne.width,ne.height);for(let Re=0;Re<6;Re++){Qe=re[Re].mipmaps;for(let ct=0;ct<Qe.length;ct++){let jt=Qe[ct];S.format!==Yi?Ee!==null?Ge?le&&t.compressedTexSubImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+Re,ct,0,0,jt.width,jt.height,Ee,jt.data):t.compressedTexImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+Re,ct,Se,jt.width,jt.height,0,jt.data):Ze("WebGLRenderer: Attempt to load unsupported compressed texture format in .setTextureCube()"):Ge?le&&t.texSubImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+Re,ct,0,0,jt.width,jt.height,Ee,_e,jt.data):t.texImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+Re,ct,Se,jt.width,jt.height,0,Ee,_e,jt.data)}}}else{if(Qe=S.mipmaps,Ge&&Ke){Qe.length>0&&ke++;let Re=qe(re[0]);t.texStorage2D(n.TEXTURE_CUBE_MAP,ke,Se,Re.width,Re.height)}for(let Re=0;Re<6;Re++)if(O){Ge?le&&t.texSubImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+Re,0,0,0,re[Re].width,re[Re].height,Ee,_e,re[Re].data):t.texImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+Re,0,Se,re[Re].width,re[Re].height,0,Ee,_e,re[Re].data);for(let ct=0;ct<Qe.length;ct++){let yi=Qe[ct].image[Re].image;Ge?le&&t.texSubImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+Re,ct+1,0,0,yi.width,yi.height,Ee,_e,yi.data):t.texImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+Re,ct+1,Se,yi.width,yi.height,0,Ee,_e,yi.data)}}else{Ge?le&&t.texSubImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+Re,0,0,0,Ee,_e,re[Re]):t.texImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+Re,0,Se,Ee,_e,re[Re]);for(let ct=0;ct<Qe.length;ct++){let jt=Qe[ct];Ge?le&&t.texSubImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+Re,ct+1,0,0,Ee,_e,jt.image[Re]):t.texImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+Re,ct+1,Se,Ee,_e,jt.image[Re])}}}T(S)&&S.mipmapsAutoUpdate===!0&&b(n.TEXTURE_CUBE_MAP),ve.__version=oe.version,S.onUpdate&&S.onUpdate(S)}C.__version=S.version}function Bt(C,S,X,ue,oe,ve){let xe=r.convert(X.format,X.colorSpace),te=r.convert(X.type),ie=A(X.internalFormat,xe,te,X.normalized,X.colorSpace),me=i.get(S),O=i.get(X);if(O.__renderTarget=S,!me.__hasExternalTextures){let re=Math.max(1,S.width>>ve),ne=Math.max(1,S.height>>ve);oe===n.TEXTURE_3D||oe===n.TEXTURE_2D_ARRAY?t.texImage3D(oe,ve,ie,re,ne,S.depth,0,xe,te,null):t.texImage2D(oe,ve,ie,re,ne,0,xe,te,null)}t.bindFramebuffer(n.FRAMEBUFFER,C),we(S)?a.framebufferTexture2DMultisampleEXT(n.FRAMEBUFFER,ue,oe,O.__webglTexture,0,ot(S)):(oe===n.TEXTURE_2D||oe>=n.TEXTURE_CUBE_MAP_POSITIVE_X&&oe<=n.TEXTURE_CUBE_MAP_NEGATIVE_Z)&&n.framebufferTexture2D(n.FRAMEBUFFER,ue,oe,O.__webglTexture,ve),t.bindFramebuffer(n.FRAMEBUFFER,null)}function Gn(C,S,X){if(n.bindRenderbuffer(n.RENDERBUFFER,C),S.depthBuffer){let ue=S.depthTexture,oe=ue&&ue.isDepthTexture?ue.type:null,ve=v(S.stencilBuffer,oe),xe=S.stencilBuffer?n.DEPTH_STENCIL_ATTACHMENT:n.DEPTH_ATTACHMENT;we(S)?a.renderbufferStorageMultisampleEXT(n.RENDERBUFFER,ot(S),ve,S.width,S.height):X?n.renderbufferStorageMultisample(n.RENDERBUFFER,ot(S),ve,S.width,S.height):n.renderbufferStorage(n.RENDERBUFFER,ve,S.width,S.height),n.framebufferRenderbuffer(n.FRAMEBUFFER,xe,n.RENDERBUFFER,C)}else{let ue=S.textures;for(let oe=0;oe<ue.length;oe++){let ve=ue[oe],xe=r.convert(ve.format,ve.colorSpace),te=r.convert(ve.type),ie=A(ve.internalFormat,xe,te,ve.normalized,ve.colorSpace);we(S)?a.renderbufferStorageMultisampleEXT(n.RENDERBUFFER,ot(S),ie,S.width,S.height):X?n.renderbufferStorageMultisample(n.RENDERBUFFER,ot(S),ie,S.width,S.height):n.renderbufferStorage(n.RENDERBUFFER,ie,S.width,S.height)}}n.bindRenderbuffer(n.RENDERBUFFER,null)}function Mt(C,S,X){let ue=S.isWebGLCubeRenderTarget===!0;if(t.bindFramebuffer(n.FRAMEBUFFER,C),!(S.depthTexture&&S.depthTexture.isDepthTexture))throw new Error("THREE.WebGLTextures: renderTarget.depthTexture must be an instance of THREE.DepthTexture.");let oe=i.get(S.depthTexture);oe.__renderTarget=S;let ve=ue?S.depthTexture.image[0]:S.depthTexture.image;(!oe.__webglTexture||ve.width!==S.width||ve.height!==S.height)&&(ve.width=S.width,ve.height=S.height,S.depthTexture.needsUpdate=!0),ue?Me(S.depthTexture,0):ge(S.depthTexture,0);let xe=oe.__webglTexture,te=ot(S),ie=ue?n.TEXTURE_CUBE_MAP_POSITIVE_X+X:n.TEXTURE_2D,me=S.depthTexture.format===Sr?n.DEPTH_STENCIL_ATTACHMENT:n.DEPTH_ATTACHMENT;if(S.depthTexture.format===vr)we(S)?a.framebufferTexture2DMultisampleEXT(n.FRAMEBUFFER,me,ie,xe,0,te):n.framebufferTexture2D(n.FRAMEBUFFER,me,ie,xe,0);else if(S.depthTexture.format===Sr)we(S)?a.framebufferTexture2DMultisampleEXT(n.FRAMEBUFFER,me,ie,xe,0,te):n.framebufferTexture2D(n.FRAMEBUFFER,me,ie,xe,0);else throw new Error("THREE.WebGLTextures: Unknown depthTexture format.")}function Nn(C){let S=i.get(C),X=C.isWebGLCubeRenderTarget===!0;if(S.__boundDepthTexture!==C.depthTexture){let ue=C.depthTexture;if(S.__depthDisposeCallback&&S.__depthDisposeCallback(),ue){let oe=()=>{delete S.__boundDepthTexture,delete S.__depthDisposeCallback,ue.removeEventListener("dispose",oe)};ue.addEventListener("dispose",oe),S.__depthDisposeCallback=oe}S.__boundDepthTexture=ue}if(C.depthTexture&&!S.__autoAllocateDepthBuffer)if(X)for(let ue=0;ue<6;ue++)Mt(S.__webglFramebuffer[ue],C,ue);else C.texture.mipmaps.length>0?Mt(S.__webglFramebuffer[0],C,0):Mt(S.__webglFramebuffer,C,0);else if(X){S.__webglDepthbuffer=[];for(let ue=0;ue<6;ue++)if(t.bindFramebuffer(n.FRAMEBUFFER,S.__webglFramebuffer[ue]),S.__webglDepthbuffer[ue]===void 0)S.__webglDepthbuffer[ue]=n.createRenderbuffer(),Gn(S.__webglDepthbuffer[ue],C,!1);else{let oe=C.stencilBuffer?n.DEPTH_STENCIL_ATTACHMENT:n.DEPTH_ATTACHMENT,ve=S.__webglDepthbuffer[ue];n.bindRenderbuffer(n.RENDERBUFFER,ve),n.framebufferRenderbuffer(n.FRAMEBUFFER,oe,n.RENDERBUFFER,ve)}}else if(C.texture.mipmaps.length>0?t.bindFramebuffer(n.FRAMEBUFFER,S.__webglFramebuffer[0]):t.bindFramebuffer(n.FRAMEBUFFER,S.__webglFramebuffer),S.__webglDepthbuffer===void 0)S.__webglDepthbuffer=n.createRenderbuffer(),Gn(S.__webglDepthbuffer,C,!1);else{let oe=C.stencilBuffer?n.DEPTH_STENCIL_ATTACHMENT:n.DEPTH_ATTACHMENT,ve=S.__webglDepthbuffer;n.bindRenderbuffer(n.RENDERBUFFER,ve),n.framebufferRenderbuffer(n.FRAMEBUFFER,oe,n.RENDERBUFFER,ve)}t.bindFramebuffer(n.FRAMEBUFFER,null)}function ln(C,S,X){let ue=i.get(C);S!==void 0&&Bt(ue.__webglFramebuffer,C,C.texture,n.COLOR_ATTACHMENT0,n.TEXTURE_2D,0),X!==void 0&&Nn(C)}function Sn(C){let S=C.texture,X=i.get(C),ue=i.get(S);C.addEventListener("dispose",z),k(C);let oe=C.textures,ve=C.isWebGLCubeRenderTarget===!0,xe=oe.length>1;if(xe||(ue.__webglTexture===void 0&&(ue.__webglTexture=n.createTexture()),ue.__version=S.version,o.memory.textures++),ve){X.__webglFramebuffer=[];for(let te=0;te<6;te++)if(S.mipmaps.length>0){X.__webglFramebuffer[te]=[];for(let ie=0;ie<S.mipmaps.length;ie++)X.__webglFramebuffer[te][ie]=n.createFramebuffer()}else X.__webglFramebuffer[te]=n.createFramebuffer()}else{if(S.mipmaps.length>0){X.__webglFramebuffer=[];for(let te=0;te<S.mipmaps.length;te++)X.__webglFramebuffer[te]=n.createFramebuffer()}else X.__webglFramebuffer=n.createFramebuffer();if(xe)for(let te=0,ie=oe.length;te<ie;te++){let me=i.get(oe[te]);me.__webglTexture===void 0&&(me.__webglTexture=n.createTexture(),o.memory.textures++)}if(C.samples>0&&we(C)===!1){X.__webglMultisampledFramebuffer=n.createFramebuffer(),X.__webglColorRenderbuffer=[],t.bindFramebuffer(n.FRAMEBUFFER,X.__webglMultisampledFramebuffer);for(let te=0;te<oe.length;te++){let ie=oe[te];X.__webglColorRenderbuffer[te]=n.createRenderbuffer(),n.bindRenderbuffer(n.RENDERBUFFER,X.__webglColorRenderbuffer[te]);let me=r.convert(ie.format,ie.colorSpace),O=r.convert(ie.type),re=A(ie.internalFormat,me,O,ie.normalized,ie.colorSpace,C.isXRRenderTarget===!0),ne=ot(C);n.renderbufferStorageMultisample(n.RENDERBUFFER,ne,re,C.width,C.height),n.framebufferRenderbuffer(n.FRAMEBUFFER,n.COLOR_ATTACHMENT0+te,n.RENDERBUFFER,X.__webglColorRenderbuffer[te])}n.bindRenderbuffer(n.RENDERBUFFER,null),C.depthBuffer&&(X.__webglDepthRenderbuffer=n.createRenderbuffer(),Gn(X.__webglDepthRenderbuffer,C,!0)),t.bindFramebuffer(n.FRAMEBUFFER,null)}}if(ve){t.bindTexture(n.TEXTURE_CUBE_MAP,ue.__webglTexture),mt(n.TEXTURE_CUBE_MAP,S);for(let te=0;te<6;te++)if(S.mipmaps.length>0)for(let ie=0;ie<S.mipmaps.length;ie++)Bt(X.__webglFramebuffer[te][ie],C,S,n.COLOR_ATTACHMENT0,n.TEXTURE_CUBE_MAP_POSITIVE_X+te,ie);else Bt(X.__webglFramebuffer[te],C,S,n.COLOR_ATTACHMENT0,n.TEXTURE_CUBE_MAP_POSITIVE_X+te,0);T(S)?b(n.TEXTURE_CUBE_MAP):S.mipmaps.length>0&&n.texParameteri(n.TEXTURE_CUBE_MAP,n.TEXTURE_MAX_LEVEL,S.mipmaps.length-1),t.unbindTexture()}else if(xe){for(let te=0,ie=oe.length;te<ie;te++){let me=oe[te],O=i.get(me),re=n.TEXTURE_2D;(C.isWebGL3DRenderTarget||C.isWebGLArrayRenderTarget)&&(re=C.isWebGL3DRenderTarget?n.TEXTURE_3D:n.TEXTURE_2D_ARRAY),t.bindTexture(re,O.__webglTexture),mt(re,me),Bt(X.__webglFramebuffer,C,me,n.COLOR_ATTACHMENT0+te,re,0),T(me)&&b(re)}t.unbindTexture()}else{let te=n.TEXTURE_2D;if((C.isWebGL3DRenderTarget||C.isWebGLArrayRenderTarget)&&(te=C.isWebGL3DRenderTarget?n.TEXTURE_3D:n.TEXTURE_2D_ARRAY),t.bindTexture(te,ue.__webglTexture),mt(te,S),S.mipmaps.length>0)for(let ie=0;ie<S.mipmaps.length;ie++)Bt(X.__webglFramebuffer[ie],C,S,n.COLOR_ATTACHMENT0,te,ie);else Bt(X.__webglFramebuffer,C,S,n.COLOR_ATTACHMENT0,te,0);T(S)?b(te):S.mipmaps.length>0&&n.texParameteri(te,n.TEXTURE_MAX_LEVEL,S.mipmaps.length-1),t.unbindTexture()}C.depthBuffer&&Nn(C)}function F(C){let S=C.textures;for(let X=0,ue=S.length;X<ue;X++){let oe=S[X];if(T(oe)&&oe.mipmapsAutoUpdate===!0){let ve=R(C),xe=i.get(oe).__webglTexture;t.bindTexture(ve,xe),b(ve),t.unbindTexture()}}}let Pe=[];function Ye(C){if(C.samples>0){if(we(C)===!1){let S=C.textures,X=C.width,ue=C.height,oe=n.COLOR_BUFFER_BIT,ve=C.stencilBuffer?n.DEPTH_STENCIL_ATTACHMENT:n.DEPTH_ATTACHMENT,xe=i.get(C),te=S.length>1;if(te)for(let me=0;me<S.length;me++)t.bindFramebuffer(n.FRAMEBUFFER,xe.__webglMultisampledFramebuffer),n.framebufferRenderbuffer(n.FRAMEBUFFER,n.COLOR_ATTACHMENT0+me,n.RENDERBUFFER,null),t.bindFramebuffer(n.FRAMEBUFFER,xe.__webglFramebuffer),n.framebufferTexture2D(n.DRAW_FRAMEBUFFER,n.COLOR_ATTACHMENT0+me,n.TEXTURE_2D,null,0);t.bindFramebuffer(n.READ_FRAMEBUFFER,xe.__webglMultisampledFramebuffer),C.texture.mipmaps.length>0?t.bindFramebuffer(n.DRAW_FRAMEBUFFER,xe.__webglFramebuffer[0]):t.bindFramebuffer(n.DRAW_FRAMEBUFFER,xe.__webglFramebuffer);for(let me=0;me<S.length;me++){if(C.resolveDepthBuffer&&(C.depthBuffer&&(oe|=n.DEPTH_BUFFER_BIT),C.stencilBuffer&&C.resolveStencilBuffer&&(oe|=n.STENCIL_BUFFER_BIT)),te){n.framebufferRenderbuffer(n.READ_FRAMEBUFFER,n.COLOR_ATTACHMENT0,n.RENDERBUFFER,xe.__webglColorRenderbuffer[me]);let O=i.get(S[me]).__webglTexture;n.framebufferTexture2D(n.DRAW_FRAMEBUFFER,n.COLOR_ATTACHMENT0,n.TEXTURE_2D,O,0)}n.blitFramebuffer(0,0,X,ue,0,0,X,ue,oe,n.NEAREST),l===!0&&(Pe.length=0,Pe.push(n.COLOR_ATTACHMENT0+me),C.depthBuffer&&C.storeMultisampledDepthBuffer===!1&&Pe.push(ve),n.invalidateFramebuffer(n.READ_FRAMEBUFFER,Pe))}if(t.bindFramebuffer(n.READ_FRAMEBUFFER,null),t.bindFramebuffer(n.DRAW_FRAMEBUFFER,null),te)for(let me=0;me<S.length;me++){t.bindFramebuffer(n.FRAMEBUFFER,xe.__webglMultisampledFramebuffer),n.framebufferRenderbuffer(n.FRAMEBUFFER,n.COLOR_ATTACHMENT0+me,n.RENDERBUFFER,xe.__webglColorRenderbuffer[me]);let O=i.get(S[me]).__webglTexture;t.bindFramebuffer(n.FRAMEBUFFER,xe.__webglFramebuffer),n.framebufferTexture2D(n.DRAW_FRAMEBUFFER,n.COLOR_ATTACHMENT0+me,n.TEXTURE_2D,O,0)}t.bindFramebuffer(n.DRAW_FRAMEBUFFER,xe.__webglMultisampledFramebuffer)}else if(C.depthBuffer&&C.storeMultisampledDepthBuffer===!1&&l){let S=C.stencilBuffer?n.DEPTH_STENCIL_ATTACHMENT:n.DEPTH_ATTACHMENT;n.invalidateFramebuffer(n.DRAW_FRAMEBUFFER,[S])}}}function ot(C){return Math.min(s.maxSamples,C.samples)}function we(C){let S=i.get(C);return C.samples>0&&e.has("WEBGL_multisampled_render_to_texture")===!0&&S.__useRenderToTexture!==!1}function Ht(C){let S=o.render.frame;u.get(C)!==S&&(u.set(C,S),C.update())}function He(C,S){let X=C.colorSpace,ue=C.format,oe=C.type;return C.isCompressedTexture===!0||C.isVideoTexture===!0||X!==Oo&&X!==Mr&&(vt.getTransfer(X)===Pt?(ue!==Yi||oe!==di)&&Ze("WebGLTextures: sRGB encoded textures have to use RGBAFormat and UnsignedByteType."):tt("WebGLTextures: Unsupported texture color space:",X)),S}function qe(C){return typeof HTMLImageElement<"u"&&C instanceof HTMLImageElement?(c.width=C.naturalWidth||C.width,c.height=C.naturalHeight||C.height):typeof VideoFrame<"u"&&C instanceof VideoFrame?(c.width=C.displayWidth,c.height=C.displayHeight):(c.width=C.width,c.height=C.height),c}this.allocateTextureUnit=he,this.resetTextureUnits=Q,this.getTextureUnits=se,this.setTextureUnits=de,this.setTexture2D=ge,this.setTexture2DArray=ye,this.setTexture3D=Ce,this.setTextureCube=Me,this.rebindTextures=ln,this.setupRenderTarget=Sn,this.updateRenderTargetMipmap=F,this.updateMultisampleRenderTarget=Ye,this.setupDepthRenderbuffer=Nn,this.setupFrameBufferTexture=Bt,this.useMultisampledRTT=we,this.dispose=G}function yC(n,e){function t(i,s=Mr){let r,o=vt.getTransfer(s);if(i===di)return n.UNSIGNED_BYTE;if(i===Jh)return n.UNSIGNED_SHORT_4_4_4_4;if(i===Kh)return n.UNSIGNED_SHORT_5_5_5_1;if(i===ym)return n.UNSIGNED_INT_5_9_9_9_REV;if(i===xm)return n.UNSIGNED_INT_10F_11F_11F_REV;if(i===_m)return n.BYTE;if(i===vm)return n.SHORT;if(i===rl)return n.UNSIGNED_SHORT;if(i===Zh)return n.INT;if(i===Ts)return n.UNSIGNED_INT;if(i===Oi)return n.FLOAT;if(i===As)return n.HALF_FLOAT;if(i===bm)return n.ALPHA;if(i===Sm)return n.RGB;if(i===Yi)return n.RGBA;if(i===vr)return n.DEPTH_COMPONENT;if(i===Sr)return n.DEPTH_STENCIL;if(i===Qh)return n.RED;if(i===ed)return n.RED_INTEGER;if(i===no)return n.RG;if(i===td)return n.RG_INTEGER;if(i===nd)return n.RGBA_INTEGER;if(i===Bc||i===kc||i===zc||i===Vc)if(o===Pt)if(r=e.get("WEBGL_compressed_texture_s3tc_srgb"),r!==null){if(i===Bc)return r.COMPRESSED_SRGB_S3TC_DXT1_EXT;if(i===kc)return r.COMPRESSED_SRGB_ALPHA_S3TC_DXT1_EXT;if(i===zc)return r.COMPRESSED_SRGB_ALPHA_S3TC_DXT3_EXT;if(i===Vc)return r.COMPRESSED_SRGB_ALPHA_S3TC_DXT5_EXT}else return null;else if(r=e.get("WEBGL_compressed_texture_s3tc"),r!==null){if(i===Bc)return r.COMPRESSED_RGB_S3TC_DXT1_EXT;if(i===kc)return r.COMPRESSED_RGBA_S3TC_DXT1_EXT;if(i===zc)return r.COMPRESSED_RGBA_S3TC_DXT3_EXT;if(i===Vc)return r.COMPRESSED_RGBA_S3TC_DXT5_EXT}else return null;if(i===id||i===sd||i===rd||i===od)if(r=e.get("WEBGL_compressed_texture_pvrtc"),r!==null){if(i===id)return r.COMPRESSED_RGB_PVRTC_4BPPV1_IMG;if(i===sd)return r.COMPRESSED_RGB_PVRTC_2BPPV1_IMG;if(i===rd)return r.COMPRESSED_RGBA_PVRTC_4BPPV1_IMG;if(i===od)return r.COMPRESSED_RGBA_PVRTC_2BPPV1_IMG}else return null;if(i===ad||i===ld||i===cd||i===ud||i===hd||i===Hc||i===dd)if(r=e.get("WEBGL_compressed_texture_etc"),r!==null){if(i===ad||i===ld)return o===Pt?r.COMPRESSED_SRGB8_ETC2:r.COMPRESSED_RGB8_ETC2;if(i===cd)return o===Pt?r.COMPRESSED_SRGB8_ALPHA8_ETC2_EAC:r.COMPRESSED_RGBA8_ETC2_EAC;if(i===ud)return r.COMPRESSED_R11_EAC;if(i===hd)return r.COMPRESSED_SIGNED_R11_EAC;if(i===Hc)return r.COMPRESSED_RG11_EAC;if(i===dd)return r.COMPRESSED_SIGNED_RG11_EAC}else return null;if(i===fd||i===pd||i===md||i===gd||i===_d||i===vd||i===yd||i===xd||i===bd||i===Sd||i===Md||i===wd||i===Ed||i===Td)if(r=e.get("WEBGL_compressed_texture_astc"),r!==null){if(i===fd)return o===Pt?r.COMPRESSED_SRGB8_ALPHA8_ASTC_4x4_KHR:r.COMPRESSED_RGBA_ASTC_4x4_KHR;if(i===pd)return o===Pt?r.COMPRESSED_SRGB8_ALPHA8_ASTC_5x4_KHR:r.COMPRESSED_RGBA_ASTC_5x4_KHR;if(i===md)return o===Pt?r.COMPRESSED_SRGB8_ALPHA8_ASTC_5x5_KHR:r.COMPRESSED_RGBA_ASTC_5x5_KHR;if(i===gd)return o===Pt?r.COMPRESSED_SRGB8_ALPHA8_ASTC_6x5_KHR:r.COMPRESSED_RGBA_ASTC_6x5_KHR;if(i===_d)return o===Pt?r.COMPRESSED_SRGB8_ALPHA8_ASTC_6x6_KHR:r.COMPRESSED_RGBA_ASTC_6x6_KHR;if(i===vd)return o===Pt?r.COMPRESSED_SRGB8_ALPHA8_ASTC_8x5_KHR:r.COMPRESSED_RGBA_ASTC_8x5_KHR;if(i===yd)return o===Pt?r.COMPRESSED_SRGB8_ALPHA8_ASTC_8x6_KHR:r.COMPRESSED_RGBA_ASTC_8x6_KHR;if(i===xd)return o===Pt?r.COMPRESSED_SRGB8_ALPHA8_ASTC_8x8_KHR:r.COMPRESSED_RGBA_ASTC_8x8_KHR;if(i===bd)return o===Pt?r.COMPRESSED_SRGB8_ALPHA8_ASTC_10x5_KHR:r.COMPRESSED_RGBA_ASTC_10x5_KHR;if(i===Sd)return o===Pt?r.COMPRESSED_SRGB8_ALPHA8_ASTC_10x6_KHR:r.COMPRESSED_RGBA_ASTC_10x6_KHR;if(i===Md)return o===Pt?r.COMPRESSED_SRGB8_ALPHA8_ASTC_10x8_KHR:r.COMPRESSED_RGBA_ASTC_10x8_KHR;if(i===wd)return o===Pt?r.COMPRESSED_SRGB8_ALPHA8_ASTC_10x10_KHR:r.COMPRESSED_RGBA_ASTC_10x10_KHR;if(i===Ed)return o===Pt?r.COMPRESSED_SRGB8_ALPHA8_ASTC_12x10_KHR:r.COMPRESSED_RGBA_ASTC_12x10_KHR;if(i===Td)return o===Pt?r.COMPRESSED_SRGB8_ALPHA8_ASTC_12x12_KHR:r.COMPRESSED_RGBA_ASTC_12x12_KHR}else return null;if(i===Ad||i===Cd||i===Rd)if(r=e.get("EXT_texture_compression_bptc"),r!==null){if(i===Ad)return o===Pt?r.COMPRESSED_SRGB_ALPHA_BPTC_UNORM_EXT:r.COMPRESSED_RGBA_BPTC_UNORM_EXT;if(i===Cd)return r.COMPRESSED_RGB_BPTC_SIGNED_FLOAT_EXT;if(i===Rd)return r.COMPRESSED_RGB_BPTC_UNSIGNED_FLOAT_EXT}else return null;if(i===Pd||i===Id||i===$c||i===Ld)if(r=e.get("EXT_texture_compression_rgtc"),r!==null){if(i===Pd)return r.COMPRESSED_RED_RGTC1_EXT;if(i===Id)return r.COMPRESSED_SIGNED_RED_RGTC1_EXT;if(i===$c)return r.COMPRESSED_RED_GREEN_RGTC2_EXT;if(i===Ld)return r.COMPRESSED_SIGNED_RED_GREEN_RGTC2_EXT}else return null;return i===Go?n.UNSIGNED_INT_24_8:n[i]!==void 0?n[i]:null}return{convert:t}}var xC=`
void main() {

	gl_Position = vec4( position, 1.0 );

}`,bC=`
uniform sampler2DArray depthColor;
uniform float depthWidth;
uniform float depthHeight;

void main() {

	vec2 coord = vec2( gl_FragCoord.x / depthWidth, gl_FragCoord.y / depthHeight );

	if ( coord.x >= 1.0 ) {

		gl_FragDepth = texture( depthColor, vec3( coord.x - 1.0, coord.y, 1 ) ).r;

	} else {

		gl_FragDepth = texture( depthColor, vec3( coord.x, coord.y, 0 ) ).r;

	}

}`,Gm=class{constructor(){this.texture=null,this.mesh=null,this.depthNear=0,this.depthFar=0}init(e,t){if(this.texture===null){let i=new wc(e.texture);(e.depthNear!==t.depthNear||e.depthFar!==t.depthFar)&&(this.depthNear=e.depthNear,this.depthFar=e.depthFar),this.texture=i}}getMesh(e){if(this.texture!==null&&this.mesh===null){let t=e.cameras[0].viewport,i=new hi({vertexShader:xC,fragmentShader:bC,uniforms:{depthColor:{value:this.texture},depthWidth:{value:t.z},depthHeight:{value:t.w}}});this.mesh=new Zn(new Tc(20,20),i)}return this.mesh}reset(){this.texture=null,this.mesh=null}getDepthTexture(){return this.texture}},Wm=class extends Hs{constructor(e,t){super();let i=this,s=null,r=1,o=null,a="local-floor",l=1,c=null,u=null,h=null,d=null,f=null,m=null,y=typeof XRWebGLBinding<"u",g=new Gm,p={},x=t.getContextAttributes(),T=null,b=null,R=[],A=[],v=new at,E=null,k=null,U=new Ei;U.viewport=new It;let I=new Ei;I.viewport=new It;let z=[U,I],H=new Wh,N=null,G=null;this.cameraAutoUpdate=!0,this.enabled=!1,this.isPresenting=!1,this.getController=function(ee){let ge=R[ee];return ge===void 0&&(ge=new Ka,R[ee]=ge),ge.getTargetRaySpace()},this.getControllerGrip=function(ee){let ge=R[ee];return ge===void 0&&(ge=new Ka,R[ee]=ge),ge.getGripSpace()},this.getHand=function(ee){let ge=R[ee];return ge===void 0&&(ge=new Ka,R[ee]=ge),ge.getHandSpace()};function Y(ee){let ge=A.indexOf(ee.inputSource);if(ge===-1)return;let ye=R[ge];ye!==void 0&&(ye.update(ee.inputSource,ee.frame,c||o),ye.dispatchEvent({type:ee.type,data:ee.inputSource}))}function W(){s.removeEventListener("select",Y),s.removeEventListener("selectstart",Y),s.removeEventListener("selectend",Y),s.removeEventListener("squeeze",Y),s.removeEventListener("squeezestart",Y),s.removeEventListener("squeezeend",Y),s.removeEventListener("end",W),s.removeEventListener("inputsourceschange",ce);for(let ee=0;ee<R.length;ee++){let ge=A[ee];ge!==null&&(A[ee]=null,R[ee].disconnect(ge))}N=null,G=null,g.reset();for(let ee in p)delete p[ee];if(e.setRenderTarget(T),f=null,d=null,h=null,s=null,b=null,he.stop(),i.isPresenting=!1,e.setPixelRatio(E),e.setSize(v.width,v.height,!1),k!==null){let ee=k.camera;ee.fov=k.fov,ee.zoom=k.zoom,ee.updateProjectionMatrix(),k=null}i.dispatchEvent({type:"sessionend"})}this.setFramebufferScaleFactor=function(ee){r=ee,i.isPresenting===!0&&Ze("WebXRManager: Cannot change framebuffer scale while presenting.")},this.setReferenceSpaceType=function(ee){a=ee,i.isPresenting===!0&&Ze("WebXRManager: Cannot change reference space type while presenting.")},this.getReferenceSpace=function(){return c||o},this.setReferenceSpace=function(ee){c=ee},this.getBaseLayer=function(){return d!==null?d:f},this.getBinding=function(){return h===null&&y&&(h=new XRWebGLBinding(s,t)),h},this.getFrame=function(){return m},this.getSession=function(){return s},this.setSession=async function(ee){if(s=ee,s!==null){if(T=e.getRenderTarget(),s.addEventListener("select",Y),s.addEventListener("selectstart",Y),s.addEventListener("selectend",Y),s.addEventListener("squeeze",Y),s.addEventListener("squeezestart",Y),s.addEventListener("squeezeend",Y),s.addEventListener("end",W),s.addEventListener("inputsourceschange",ce),x.xrCompatible!==!0&&await t.makeXRCompatible(),E=e.getPixelRatio(),e.getSize(v),y&&"createProjectionLayer"in XRWebGLBinding.prototype){let ye=null,Ce=null,Me=null;x.depth&&(Me=x.stencil?t.DEPTH24_STENCIL8:t.DEPTH_COMPONENT24,ye=x.stencil?Sr:vr,Ce=x.stencil?Go:Ts);let We={colorFormat:t.RGBA8,depthFormat:Me,scaleFactor:r};h=this.getBinding(),d=h.createProjectionLayer(We),s.updateRenderState({layers:[d]}),e.setPixelRatio(1),e.setSize(d.textureWidth,d.textureHeight,!1),b=new Ai(d.textureWidth,d.textureHeight,{format:Yi,type:di,depthTexture:new Es(d.textureWidth,d.textureHeight,Ce,void 0,void 0,void 0,void 0,void 0,void 0,ye),stencilBuffer:x.stencil,colorSpace:e.outputColorSpace,samples:x.antialias?4:0,resolveDepthBuffer:d.ignoreDepthValues===!1,resolveStencilBuffer:d.ignoreDepthValues===!1,storeMultisampledDepthBuffer:d.ignoreDepthValues===!1,storeMultisampledStencilBuffer:d.ignoreDepthValues===!1})}else{let ye={antialias:x.antialias,alpha:!0,depth:x.depth,stencil:x.stencil,framebufferScaleFactor:r};f=new XRWebGLLayer(s,t,ye),s.updateRenderState({baseLayer:f}),e.setPixelRatio(1),e.setSize(f.framebufferWidth,f.framebufferHeight,!1),b=new Ai(f.framebufferWidth,f.framebufferHeight,{format:Yi,type:di,colorSpace:e.outputColorSpace,stencilBuffer:x.stencil,resolveDepthBuffer:f.ignoreDepthValues===!1,resolveStencilBuffer:f.ignoreDepthValues===!1,storeMultisampledDepthBuffer:f.ignoreDepthValues===!1,storeMultisampledStencilBuffer:f.ignoreDepthValues===!1})}b.isXRRenderTarget=!0,this.setFoveation(l),c=null,o=await s.requestReferenceSpace(a),he.setContext(s),he.start(),i.isPresenting=!0,i.dispatchEvent({type:"sessionstart"})}},this.getEnvironmentBlendMode=function(){if(s!==null)return s.environmentBlendMode},this.getDepthTexture=function(){return g.getDepthTexture()};function ce(ee){for(let ge=0;ge<ee.removed.length;ge++){let ye=ee.removed[ge],Ce=A.indexOf(ye);Ce>=0&&(A[Ce]=null,R[Ce].disconnect(ye))}for(let ge=0;ge<ee.added.length;ge++){let ye=ee.added[ge],Ce=A.indexOf(ye);if(Ce===-1){for(let We=0;We<R.length;We++)if(We>=A.length){A.push(ye),Ce=We;break}else if(A[We]===null){A[We]=ye,Ce=We;break}if(Ce===-1)break}let Me=R[Ce];Me&&Me.connect(ye)}}function J(ee,ge){ge===null?ee.matrixWorld.copy(ee.matrix):ee.matrixWorld.multiplyMatrices(ge.matrixWorld,ee.matrix),ee.matrixWorldInverse.copy(ee.matrixWorld).invert()}this.updateCamera=function(ee){if(s===null)return;let ge=ee.near,ye=ee.far;g.texture!==null&&(g.depthNear>0&&(ge=g.depthNear),g.depthFar>0&&(ye=g.depthFar)),H.near=I.near=U.near=ge,H.far=I.far=U.far=ye,(N!==H.near||G!==H.far)&&(s.updateRenderState({depthNear:H.near,depthFar:H.far}),N=H.near,G=H.far),H.layers.mask=ee.layers.mask|6,U.layers.mask=H.layers.mask&-5,I.layers.mask=H.layers.mask&-3;let Ce=ee.parent,Me=H.cameras;J(H,Ce);for(let We=0;We<Me.length;We++)J(Me[We],Ce);H.projectionMatrix.copy(U.projectionMatrix),H.projectionMatrixInverse.copy(U.projectionMatrixInverse),k===null&&ee.isPerspectiveCamera&&(k={camera:ee,fov:ee.fov,zoom:ee.zoom}),Q(ee,H,Ce)};function Q(ee,ge,ye){ye===null?ee.matrix.copy(ge.matrixWorld):(ee.matrix.copy(ye.matrixWorld),ee.matrix.invert(),ee.matrix.multiply(ge.matrixWorld)),ee.matrix.decompose(ee.position,ee.quaternion,ee.scale),ee.updateMatrixWorld(!0),ee.projectionMatrix.copy(ge.projectionMatrix),ee.projectionMatrixInverse.copy(ge.projectionMatrixInverse),ee.isPerspectiveCamera&&(ee.fov=Za*2*Math.atan(1/ee.projectionMatrix.elements[5]),ee.zoom=1)}this.getCamera=function(){return H},this.getFoveation=function(){if(!(d===null&&f===null))return l},this.setFoveation=function(ee){l=ee,d!==null&&(d.fixedFoveation=ee),f!==null&&f.fixedFoveation!==void 0&&(f.fixedFoveation=ee)},this.hasDepthSensing=function(){return g.texture!==null},this.getDepthSensingMesh=function(){return g.getMesh(H)},this.getCameraTexture=function(ee){return p[ee]};let se=null;function de(ee,ge){if(u=ge.getViewerPose(c||o),m=ge,u!==null){let ye=u.views;f!==null&&(e.setRenderTargetFramebuffer(b,f.framebuffer),e.setRenderTarget(b));let Ce=!1;ye.length!==H.cameras.length&&(H.cameras.length=0,Ce=!0);for(let $e=0;$e<ye.length;$e++){let mt=ye[$e],dt=null;if(f!==null)dt=f.getViewport(mt);else{let nn=h.getViewSubImage(d,mt);dt=nn.viewport,$e===0&&(e.setRenderTargetTextures(b,nn.colorTexture,nn.depthStencilTexture),e.setRenderTarget(b))}let it=z[$e];it===void 0&&(it=new Ei,it.layers.enable($e),it.viewport=new It,z[$e]=it),it.matrix.fromArray(mt.transform.matrix),it.matrix.decompose(it.position,it.quaternion,it.scale),it.projectionMatrix.fromArray(mt.projectionMatrix),it.projectionMatrixInverse.copy(it.projectionMatrix).invert(),it.viewport.set(dt.x,dt.y,dt.width,dt.height),$e===0&&(H.matrix.copy(it.matrix),H.matrix.decompose(H.position,H.quaternion,H.scale)),Ce===!0&&H.cameras.push(it)}let Me=s.enabledFeatures;if(Me&&Me.includes("depth-sensing")&&s.depthUsage=="gpu-optimized"&&y){h=i.getBinding();let $e=h.getDepthInformation(ye[0]);$e&&$e.isValid&&$e.texture&&g.init($e,s.renderState)}if(Me&&Me.includes("camera-access")&&y){e.state.unbindTexture(),h=i.getBinding();for(let $e=0;$e<ye.length;$e++){let mt=ye[$e].camera;if(mt){let dt=p[mt];dt||(dt=new wc,p[mt]=dt);let it=h.getCameraImage(mt);dt.sourceTexture=it}}}}for(let ye=0;ye<R.length;ye++){let Ce=A[ye],Me=R[ye];Ce!==null&&Me!==void 0&&Me.update(Ce,ge,c||o)}se&&se(ee,ge),ge.detectedPlanes&&i.dispatchEvent({type:"planesdetected",data:ge}),m=null}let he=new ey;he.setAnimationLoop(de),this.setAnimationLoop=function(ee){se=ee},this.dispose=function(){}}},SC=new ht,uy=new nt;uy.set(-1,0,0,0,1,0,0,0,1);function MC(n,e){function t(g,p){g.matrixAutoUpdate===!0&&g.updateMatrix(),p.value.copy(g.matrix)}function i(g,p){p.color.getRGB(g.fogColor.value,Lm(n)),p.isFog?(g.fogNear.value=p.near,g.fogFar.value=p.far):p.isFogExp2&&(g.fogDensity.value=p.density)}function s(g,p,x,T,b){p.isNodeMaterial?p.uniformsNeedUpdate=!1:p.isMeshBasicMaterial?r(g,p):p.isMeshLambertMaterial?(r(g,p),p.envMap&&(g.envMapIntensity.value=p.envMapIntensity)):p.isMeshToonMaterial?(r(g,p),h(g,p)):p.isMeshPhongMaterial?(r(g,p),u(g,p),p.envMap&&(g.envMapIntensity.value=p.envMapIntensity)):p.isMeshStandardMaterial?(r(g,p),d(g,p),p.isMeshPhysicalMaterial&&f(g,p,b)):p.isMeshMatcapMaterial?(r(g,p),m(g,p)):p.isMeshDepthMaterial?r(g,p):p.isMeshDistanceMaterial?(r(g,p),y(g,p)):p.isMeshNormalMaterial?r(g,p):p.isLineBasicMaterial?(o(g,p),p.isLineDashedMaterial&&a(g,p)):p.isPointsMaterial?l(g,p,x,T):p.isSpriteMaterial?c(g,p):p.isShadowMaterial?(g.color.value.copy(p.color),g.opacity.value=p.opacity):p.isShaderMaterial&&(p.uniformsNeedUpdate=!1)}function r(g,p){g.opacity.value=p.opacity,p.color&&g.diffuse.value.copy(p.color),p.emissive&&g.emissive.value.copy(p.emissive).multiplyScalar(p.emissiveIntensity),p.map&&(g.map.value=p.map,t(p.map,g.mapTransform)),p.alphaMap&&(g.alphaMap.value=p.alphaMap,t(p.alphaMap,g.alphaMapTransform)),p.bumpMap&&(g.bumpMap.value=p.bumpMap,t(p.bumpMap,g.bumpMapTransform),g.bumpScale.value=p.bumpScale,p.side===Ci&&(g.bumpScale.value*=-1)),p.normalMap&&(g.normalMap.value=p.normalMap,t(p.normalMap,g.normalMapTransform),g.normalScale.value.copy(p.normalScale),p.side===Ci&&g.normalScale.value.negate()),p.displacementMap&&(g.displacementMap.value=p.displacementMap,t(p.displacementMap,g.displacementMapTransform),g.displacementScale.value=p.displacementScale,g.displacementBias.value=p.displacementBias),p.emissiveMap&&(g.emissiveMap.value=p.emissiveMap,t(p.emissiveMap,g.emissiveMapTransform)),p.specularMap&&(g.specularMap.value=p.specularMap,t(p.specularMap,g.specularMapTransform)),p.alphaTest>0&&(g.alphaTest.value=p.alphaTest);let x=e.get(p),T=x.envMap,b=x.envMapRotation;T&&(g.envMap.value=T,g.envMapRotation.value.setFromMatrix4(SC.makeRotationFromEuler(b)).transpose(),T.isCubeTexture&&T.isRenderTargetTexture===!1&&g.envMapRotation.value.premultiply(uy),g.reflectivity.value=p.reflectivity,g.ior.value=p.ior,g.refractionRatio.value=p.refractionRatio),p.lightMap&&(g.lightMap.value=p.lightMap,g.lightMapIntensity.value=p.lightMapIntensity,t(p.lightMap,g.lightMapTransform)),p.aoMap&&(g.aoMap.value=p.aoMap,g.aoMapIntensity.value=p.aoMapIntensity,t(p.aoMap,g.aoMapTransform))}function o(g,p){g.diffuse.value.copy(p.color),g.opacity.value=p.opacity,p.map&&(g.map.value=p.map,t(p.map,g.mapTransform))}function a(g,p){g.dashSize.value=p.dashSize,g.totalSize.value=p.dashSize+p.gapSize,g.scale.value=p.scale}function l(g,p,x,T){g.diffuse.value.copy(p.color),g.opacity.value=p.opacity,g.size.value=p.size*x,g.scale.value=T*.5,p.map&&(g.map.value=p.map,t(p.map,g.uvTransform)),p.alphaMap&&(g.alphaMap.value=p.alphaMap,t(p.alphaMap,g.alphaMapTransform)),p.alphaTest>0&&(g.alphaTest.value=p.alphaTest)}function c(g,p){g.diffuse.value.copy(p.color),g.opacity.value=p.opacity,g.rotation.value=p.rotation,p.map&&(g.map.value=p.map,t(p.map,g.mapTransform)),p.alphaMap&&(g.alphaMap.value=p.alphaMap,t(p.alphaMap,g.alphaMapTransform)),p.alphaTest>0&&(g.alphaTest.value=p.alphaTest)}function u(g,p){g.specular.value.copy(p.specular),g.shininess.value=Math.max(p.shininess,1e-4)}function h(g,p){p.gradientMap&&(g.gradientMap.value=p.gradientMap)}function d(g,p){g.metalness.value=p.metalness,p.metalnessMap&&(g.metalnessMap.value=p.metalnessMap,t(p.metalnessMap,g.metalnessMapTransform)),g.roughness.value=p.roughness,p.roughnessMap&&(g.roughnessMap.value=p.roughnessMap,t(p.roughnessMap,g.roughnessMapTransform)),p.envMap&&(g.envMapIntensity.value=p.envMapIntensity)}function f(g,p,x){g.ior.value=p.ior,p.diffuseRoughness>0&&(g.diffuseRoughness.value=p.diffuseRoughness,p.diffuseRoughnessMap&&(g.diffuseRoughnessMap.value=p.diffuseRoughnessMap,t(p.diffuseRoughnessMap,g.diffuseRoughnessMapTransform))),p.sheen>0&&(g.sheenColor.value.copy(p.sheenColor).multiplyScalar(p.sheen),g.sheenRoughness.value=p.sheenRoughness,p.sheenColorMap&&(g.sheenColorMap.value=p.sheenColorMap,t(p.sheenColorMap,g.sheenColorMapTransform)),p.sheenRoughnessMap&&(g.sheenRoughnessMap.value=p.sheenRoughnessMap,t(p.sheenRoughnessMap,g.sheenRoughnessMapTransform))),p.clearcoat>0&&(g.clearcoat.value=p.clearcoat,g.clearcoatRoughness.value=p.clearcoatRoughness,p.clearcoatMap&&(g.clearcoatMap.value=p.clearcoatMap,t(p.clearcoatMap,g.clearcoatMapTransform)),p.clearcoatRoughnessMap&&(g.clearcoatRoughnessMap.value=p.clearcoatRoughnessMap,t(p.clearcoatRoughnessMap,g.clearcoatRoughnessMapTransform)),p.clearcoatNormalMap&&(g.clearcoatNormalMap.value=p.clearcoatNormalMap,t(p.clearcoatNormalMap,g.clearcoatNormalMapTransform),g.clearcoatNormalScale.value.copy(p.clearcoatNormalScale),p.side===Ci&&g.clearcoatNormalScale.value.negate())),p.dispersion>0&&(g.dispersion.value=p.dispersion),p.retroreflectivity>0&&(g.retroreflectivity.value=p.retroreflectivity),p.iridescence>0&&(g.iridescence.value=p.iridescence,g.iridescenceIOR.value=p.iridescenceIOR,g.iridescenceThicknessMinimum.value=p.iridescenceThicknessMinimum,g.iridescenceThicknessMaximum.value=p.iridescenceThicknessMaximum,p.iridescenceMap&&(g.iridescenceMap.value=p.iridescenceMap,t(p.iridescenceMap,g.iridescenceMapTransform)),p.iridescenceThicknessMap&&(g.iridescenceThicknessMap.value=p.iridescenceThicknessMap,t(p.iridescenceThicknessMap,g.iridescenceThicknessMapTransform))),p.transmission>0&&(g.transmission.value=p.transmission,g.transmissionSamplerMap.value=x.texture,g.transmissionSamplerSize.value.set(x.width,x.height),p.transmissionMap&&(g.transmissionMap.value=p.transmissionMap,t(p.transmissionMap,g.transmissionMapTransform)),g.thickness.value=p.thickness,p.thicknessMap&&(g.thicknessMap.value=p.thicknessMap,t(p.thicknessMap,g.thicknessMapTransform)),g.attenuationDistance.value=p.attenuationDistance,g.attenuationColor.value.copy(p.attenuationColor)),p.anisotropy>0&&(g.anisotropyVector.value.set(p.anisotropy*Math.cos(p.anisotropyRotation),p.anisotropy*Math.sin(p.anisotropyRotation)),p.anisotropyMap&&(g.anisotropyMap.value=p.anisotropyMap,t(p.anisotropyMap,g.anisotropyMapTransform))),g.specularIntensity.value=p.specularIntensity,g.specularColor.value.copy(p.specularColor),p.specularColorMap&&(g.specularColorMap.value=p.specularColorMap,t(p.specularColorMap,g.specularColorMapTransform)),p.specularIntensityMap&&(g.specularIntensityMap.value=p.specularIntensityMap,t(p.specularIntensityMap,g.specularIntensityMapTransform))}function m(g,p){p.matcap&&(g.matcap.value=p.matcap)}function y(g,p){let x=e.get(p).light;g.referencePosition.value.setFromMatrixPosition(x.matrixWorld),g.nearDistance.value=x.shadow.camera.near,g.farDistance.value=x.shadow.camera.far}return{refreshFogUniforms:i,refreshMaterialUniforms:s}}function wC(n,e,t,i){let s={},r={};function o(x,T){let b=T.program;i.uniformBlockBinding(x,b,s[x.id])}function a(x,T){let b=s[x.id];b===void 0&&(m(x),b=l(x),s[x.id]=b,x.addEventListener("dispose",g));let R=T.program;i.updateUBOMapping(x,R);let A=e.render.frame;r[x.id]!==A&&(c(x),r[x.id]=A)}function l(x){let T=n.createBuffer(),b=x.__size,R=x.usage;return n.bindBuffer(n.UNIFORM_BUFFER,T),n.bufferData(n.UNIFORM_BUFFER,b,R),n.bindBuffer(n.UNIFORM_BUFFER,null),T}function c(x){let T=s[x.id],b=x.uniforms,R=x.__cache;n.bindBuffer(n.UNIFORM_BUFFER,T);for(let A=0,v=b.length;A<v;A++){let E=b[A];if(Array.isArray(E))for(let k=0,U=E.length;k<U;k++)u(E[k],A,k,R);else u(E,A,0,R)}n.bindBuffer(n.UNIFORM_BUFFER,null)}function u(x,T,b,R){if(d(x,T,b,R)===!0){let A=x.__offset,v=x.value;if(Array.isArray(v)){let E=0;for(let k=0;k<v.length;k++){let U=v[k],I=y(U,!0);h(U,x.__data,E),E+=I.storage/Float32Array.BYTES_PER_ELEMENT}}else h(v,x.__data,0);n.bufferSubData(n.UNIFORM_BUFFER,A,x.__data)}}function h(x,T,b){typeof x=="number"||typeof x=="boolean"?T[b]=x:x.isMatrix3?(T[b]=x.elements[0],T[b+1]=x.elements[1],T[b+2]=x.elements[2],T[b+3]=0,T[b+4]=x.elements[3],T[b+5]=x.elements[4],T[b+6]=x.elements[5],T[b+7]=0,T[b+8]=x.elements[6],T[b+9]=x.elements[7],T[b+10]=x.elements[8],T[b+11]=0):ArrayBuffer.isView(x)?T.set(x.subarray(0,T.length-b),b):x.toArray(T,b)}function d(x,T,b,R){let A=x.value,v=T+"_"+b;if(Array.isArray(A)){R[v]===void 0&&(R[v]=[]);let E=R[v],k=!1;for(let U=0;U<A.length;U++)f(A[U],E,U)===!0&&(k=!0);return k}return f(A,R,v)}function f(x,T,b){if(T[b]===void 0)return typeof x=="number"||typeof x=="boolean"?T[b]=x:ArrayBuffer.isView(x)?T[b]=x.slice():T[b]=x.clone(),!0;{let R=T[b];if(typeof x=="number"||typeof x=="boolean"){if(R!==x)return T[b]=x,!0}else{if(ArrayBuffer.isView(x))return!0;if(R.equals(x)===!1)return R.copy(x),!0}}return!1}function m(x){let T=x.uniforms,b=0,R=16;for(let v=0,E=T.length;v<E;v++){let k=Array.isArray(T[v])?T[v]:[T[v]];for(let U=0,I=k.length;U<I;U++){let z=k[U],H=Array.isArray(z.value)?z.value:[z.value],N=Array.isArray(T[v])||Array.isArray(z.value),G=b;for(let W=0,ce=H.length;W<ce;W++){let J=H[W],Q=y(J,N),se=b%R,de=se%Q.boundary,he=se+de;b+=de,he!==0&&R-he<Q.storage&&(b+=R-he),W===0&&(G=b),b+=Q.storage}let Y=z.type==="int"?Int32Array:z.type==="uint"?Uint32Array:Float32Array;z.__data=new Y((b-G)/Float32Array.BYTES_PER_ELEMENT),z.__offset=G}}let A=b%R;return A>0&&(b+=R-A),x.__size=b,x.__cache={},this}function y(x,T){let b={boundary:0,storage:0};return typeof x=="number"||typeof x=="boolean"?(b.boundary=4,b.storage=4):x.isVector2?(b.boundary=8,b.storage=8):x.isVector3||x.isColor?(b.boundary=16,b.storage=12):x.isVector4?(b.boundary=16,b.storage=16):x.isMatrix3?(b.boundary=16,b.storage=48):x.isMatrix4?(b.boundary=16,b.storage=64):x.isTexture?Ze("WebGLRenderer: Texture samplers can not be part of an uniforms group."):ArrayBuffer.isView(x)?(b.boundary=16,b.storage=x.byteLength):Ze("WebGLRenderer: Unsupported uniform value type.",x),T===!0&&(b.boundary=16,b.storage=Math.ceil(b.storage/16)*16),b}function g(x){let T=x.target;T.removeEventListener("dispose",g),n.deleteBuffer(s[T.id]),delete s[T.id],delete r[T.id]}function p(){for(let x in s)n.deleteBuffer(s[x]);s={},r={}}return{bind:o,update:a,dispose:p}}var EC=new Uint16Array([12469,15057,12620,14925,13266,14620,13807,14376,14323,13990,14545,13625,14713,13328,14840,12882,14931,12528,14996,12233,15039,11829,15066,11525,15080,11295,15085,10976,15082,10705,15073,10495,13880,14564,13898,14542,13977,14430,14158,14124,14393,13732,14556,13410,14702,12996,14814,12596,14891,12291,14937,11834,14957,11489,14958,11194,14943,10803,14921,10506,14893,10278,14858,9960,14484,14039,14487,14025,14499,13941,14524,13740,14574,13468,14654,13106,14743,12678,14818,12344,14867,11893,14889,11509,14893,11180,14881,10751,14852,10428,14812,10128,14765,9754,14712,9466,14764,13480,14764,13475,14766,13440,14766,13347,14769,13070,14786,12713,14816,12387,14844,11957,14860,11549,14868,11215,14855,10751,14825,10403,14782,10044,14729,9651,14666,9352,14599,9029,14967,12835,14966,12831,14963,12804,14954,12723,14936,12564,14917,12347,14900,11958,14886,11569,14878,11247,14859,10765,14828,10401,14784,10011,14727,9600,14660,9289,14586,8893,14508,8533,15111,12234,15110,12234,15104,12216,15092,12156,15067,12010,15028,11776,14981,11500,14942,11205,14902,10752,14861,10393,14812,9991,14752,9570,14682,9252,14603,8808,14519,8445,14431,8145,15209,11449,15208,11451,15202,11451,15190,11438,15163,11384,15117,11274,15055,10979,14994,10648,14932,10343,14871,9936,14803,9532,14729,9218,14645,8742,14556,8381,14461,8020,14365,7603,15273,10603,15272,10607,15267,10619,15256,10631,15231,10614,15182,10535,15118,10389,15042,10167,14963,9787,14883,9447,14800,9115,14710,8665,14615,8318,14514,7911,14411,7507,14279,7198,15314,9675,15313,9683,15309,9712,15298,9759,15277,9797,15229,9773,15166,9668,15084,9487,14995,9274,14898,8910,14800,8539,14697,8234,14590,7790,14479,7409,14367,7067,14178,6621,15337,8619,15337,8631,15333,8677,15325,8769,15305,8871,15264,8940,15202,8909,15119,8775,15022,8565,14916,8328,14804,8009,14688,7614,14569,7287,14448,6888,14321,6483,14088,6171,15350,7402,15350,7419,15347,7480,15340,7613,15322,7804,15287,7973,15229,8057,15148,8012,15046,7846,14933,7611,14810,7357,14682,7069,14552,6656,14421,6316,14251,5948,14007,5528,15356,5942,15356,5977,15353,6119,15348,6294,15332,6551,15302,6824,15249,7044,15171,7122,15070,7050,14949,6861,14818,6611,14679,6349,14538,6067,14398,5651,14189,5311,13935,4958,15359,4123,15359,4153,15356,4296,15353,4646,15338,5160,15311,5508,15263,5829,15188,6042,15088,6094,14966,6001,14826,5796,14678,5543,14527,5287,14377,4985,14133,4586,13869,4257,15360,1563,15360,1642,15358,2076,15354,2636,15341,3350,15317,4019,15273,4429,15203,4732,15105,4911,14981,4932,14836,4818,14679,4621,14517,4386,14359,4156,14083,3795,13808,3437,15360,122,15360,137,15358,285,15355,636,15344,1274,15322,2177,15281,2765,15215,3223,15120,3451,14995,3569,14846,3567,14681,3466,14511,3305,14344,3121,14037,2800,13753,2467,15360,0,15360,1,15359,21,15355,89,15346,253,15325,479,15287,796,15225,1148,15133,1492,15008,1749,14856,1882,14685,1886,14506,1783,14324,1608,13996,1398,13702,1183]),Xs=null;function TC(){return Xs===null&&(Xs=new Bo(EC,16,16,no,As),Xs.name="DFG_LUT",Xs.minFilter=Ti,Xs.magFilter=Ti,Xs.wrapS=Vs,Xs.wrapT=Vs,Xs.generateMipmaps=!1,Xs.needsUpdate=!0),Xs}var Bd=class{constructor(e={}){let{canvas:t=Tv(),context:i=null,depth:s=!0,stencil:r=!1,alpha:o=!1,antialias:a=!1,premultipliedAlpha:l=!0,preserveDrawingBuffer:c=!1,powerPreference:u="default",failIfMajorPerformanceCaveat:h=!1,reversedDepthBuffer:d=!1,outputBufferType:f=di}=e;this.isWebGLRenderer=!0;let m;if(i!==null){if(typeof WebGLRenderingContext<"u"&&i instanceof WebGLRenderingContext)throw new Error("THREE.WebGLRenderer: WebGL 1 is not supported since r163.");m=i.getContextAttributes().alpha}else m=o;let y=f,g=new Set([nd,td,ed]),p=new Set([di,Ts,rl,Go,Jh,Kh]),x=new Uint32Array(4),T=new Int32Array(4),b={textures:[],min:[],max:[],resolution:[]},R=null,A=null,v=[],E=[],k=null;this.domElement=t,this.debug={checkShaderErrors:!0,diagnostics:{keywords:!1},onShaderError:null},this.autoClear=!0,this.autoClearColor=!0,this.autoClearDepth=!0,this.autoClearStencil=!0,this.sortObjects=!0,this.clippingPlanes=[],this.localClippingEnabled=!1,this.toneMapping=Ws,this.toneMappingExposure=1,this.transmissionResolutionScale=1;let U=this,I=!1,z=null,H=null,N=null,G=null;this._outputColorSpace=Xi;let Y=0,W=0,ce=null,J=-1,Q=null,se=new It,de=new It,he=null,ee=new lt(0),ge=0,ye=t.width,Ce=t.height,Me=1,We=null,rt=null,$e=new It(0,0,ye,Ce),mt=new It(0,0,ye,Ce),dt=!1,it=new Gs,nn=new Ch,qt=!1,bn=!1,Bt=new ht,Gn=new B,Mt=new It,Nn={background:null,fog:null,environment:null,overrideMaterial:null,isScene:!0},ln=!1;function Sn(){return ce===null?Me:1}let F=i;function Pe(w,V){return t.getContext(w,V)}let Ye,ot,we,Ht,He,qe,C,S,X,ue,oe,ve,xe,te,ie,me,O,re,ne,Ee,_e,Se,Ge;try{let w={alpha:!0,depth:s,stencil:r,antialias:a,premultipliedAlpha:l,preserveDrawingBuffer:c,powerPreference:u,failIfMajorPerformanceCaveat:h};if("setAttribute"in t&&t.setAttribute("data-engine",`three.js r${"187"}`),t.addEventListener("webglcontextlost",ke,!1),t.addEventListener("webglcontextrestored",Qe,!1),t.addEventListener("webglcontextcreationerror",Re,!1),F===null){let V="webgl2";if(F=Pe(V,w),F===null)throw Pe(V)?new Error("THREE.WebGLRenderer: Error creating WebGL context with your selected attributes."):new Error("THREE.WebGLRenderer: Error creating WebGL context.")}Ke()}catch(w){throw t.removeEventListener("webglcontextlost",ke,!1),t.removeEventListener("webglcontextrestored",Qe,!1),t.removeEventListener("webglcontextcreationerror",Re,!1),tt("WebGLRenderer: "+w.message),w}function Ke(){Ye=new FT(F),Ye.init(),_e=new yC(F,Ye),ot=new TT(F,Ye,e,_e),we=new _C(F,Ye),ot.reversedDepthBuffer&&d&&we.buffers.depth.setReversed(!0),H=F.createFramebuffer(),N=F.createFramebuffer(),G=F.createFramebuffer(),Ht=new zT(F),He=new iC,qe=new vC(F,Ye,we,He,ot,_e,Ht),C=new OT(U),S=new Hw(F),Se=new wT(F,S),X=new BT(F,S,Ht,Se),ue=new HT(F,X,S,Se,Ht),re=new VT(F,ot,qe),ie=new AT(He),oe=new nC(U,C,Ye,ot,Se,ie),ve=new MC(U,He),xe=new rC,te=new hC(Ye),O=new MT(U,C,we,ue,m,l),me=new gC(U,ue,ot),Ge=new wC(F,Ht,ot,we),ne=new ET(F,Ye,Ht),Ee=new kT(F,Ye,Ht),Ht.programs=oe.programs,U.capabilities=ot,U.extensions=Ye,U.properties=He,U.renderLists=xe,U.shadowMap=me,U.state=we,U.info=Ht}y!==di&&(k=new GT(y,t.width,t.height,a,s,r));let le=new Wm(U,F);this.xr=le,this.getContext=function(){return F},this.getContextAttributes=function(){return F.getContextAttributes()},this.forceContextLoss=function(){let w=Ye.get("WEBGL_lose_context");w&&w.loseContext()},this.forceContextRestore=function(){let w=Ye.get("WEBGL_lose_context");w&&w.restoreContext()},this.getPixelRatio=function(){return Me},this.setPixelRatio=function(w){w!==void 0&&(Me=w,this.setSize(ye,Ce,!1))},this.getSize=function(w){return w.set(ye,Ce)},this.setSize=function(w,V,K=!0){if(le.isPresenting){Ze("WebGLRenderer: Can't change size while VR device is presenting.");return}ye=w,Ce=V,t.width=Math.floor(w*Me),t.height=Math.floor(V*Me),K===!0&&(t.style.width=w+"px",t.style.height=V+"px"),k!==null&&k.setSize(t.width,t.height),this.setViewport(0,0,w,V)},this.getDrawingBufferSize=function(w){return w.set(ye*Me,Ce*Me).floor()},this.setDrawingBufferSize=function(w,V,K){ye=w,Ce=V,Me=K,t.width=Math.floor(w*K),t.height=Math.floor(V*K),this.setViewport(0,0,w,V)},this.setEffects=function(w){if(y===di){tt("WebGLRenderer: setEffects() requires outputBufferType set to HalfFloatType or FloatType.");return}if(w){for(let V=0;V<w.length;V++)if(w[V].isOutputPass===!0){Ze("WebGLRenderer: OutputPass is not needed in setEffects(). Tone mapping and color space conversion are applied automatically.");break}}k.setEffects(w||[])},this.getCurrentViewport=function(w){return w.copy(se)},this.getViewport=function(w){return w.copy($e)},this.setViewport=function(w,V,K,q){w.isVector4?$e.set(w.x,w.y,w.z,w.w):$e.set(w,V,K,q),we.viewport(se.copy($e).multiplyScalar(Sn()).round())},this.getScissor=function(w){return w.copy(mt)},this.setScissor=function(w,V,K,q){w.isVector4?mt.set(w.x,w.y,w.z,w.w):mt.set(w,V,K,q),we.scissor(de.copy(mt).multiplyScalar(Sn()).round())},this.getScissorTest=function(){return dt},this.setScissorTest=function(w){we.setScissorTest(dt=w)},this.setOpaqueSort=function(w){We=w},this.setTransparentSort=function(w){rt=w},this.getClearColor=function(w){return w.copy(O.getClearColor())},this.setClearColor=function(){O.setClearColor(...arguments)},this.getClearAlpha=function(){return O.getClearAlpha()},this.setClearAlpha=function(){O.setClearAlpha(...arguments)},this.clear=function(w=!0,V=!0,K=!0){let q=0;if(w){let j=!1;if(ce!==null){let Te=ce.texture.format;j=g.has(Te)}if(j){let Te=ce.texture.type,Le=p.has(Te),Ae=O.getClearColor(),De=O.getClearAlpha(),Ve=Ae.r,et=Ae.g,gt=Ae.b;Le?(x[0]=Ve,x[1]=et,x[2]=gt,x[3]=De,F.clearBufferuiv(F.COLOR,0,x)):(T[0]=Ve,T[1]=et,T[2]=gt,T[3]=De,F.clearBufferiv(F.COLOR,0,T))}else q|=F.COLOR_BUFFER_BIT}V&&(q|=F.DEPTH_BUFFER_BIT,this.state.buffers.depth.setMask(!0)),K&&(q|=F.STENCIL_BUFFER_BIT,this.state.buffers.stencil.setMask(4294967295)),q!==0&&F.clear(q)},this.clearColor=function(){this.clear(!0,!1,!1)},this.clearDepth=function(){this.clear(!1,!0,!1)},this.clearStencil=function(){this.clear(!1,!1,!0)},this.setNodesHandler=function(w){w.setRenderer(this),z=w},this.dispose=function(){t.removeEventListener("webglcontextlost",ke,!1),t.removeEventListener("webglcontextrestored",Qe,!1),t.removeEventListener("webglcontextcreationerror",Re,!1),O.dispose(),xe.dispose(),te.dispose(),qe.dispose(),He.dispose(),C.dispose(),ue.dispose(),X.dispose(),Se.dispose(),Ge.dispose(),oe.dispose(),le.dispose(),le.removeEventListener("sessionstart",Su),le.removeEventListener("sessionend",Ds),rr.stop()};function ke(w){w.preventDefault(),pc("WebGLRenderer: Context Lost."),I=!0}function Qe(){pc("WebGLRenderer: Context Restored."),I=!1;let w=Ht.autoReset,V=me.enabled,K=me.autoUpdate,q=me.needsUpdate,j=me.type;Ke(),Ht.autoReset=w,me.enabled=V,me.autoUpdate=K,me.needsUpdate=q,me.type=j}function Re(w){tt("WebGLRenderer: A WebGL context could not be created. Reason: ",w.statusMessage)}function ct(w){let V=w.target;V.removeEventListener("dispose",ct),jt(V)}function jt(w){yi(w),He.remove(w)}function yi(w){let V=He.get(w).programs;V!==void 0&&(V.forEach(function(K){oe.releaseProgram(K)}),w.isShaderMaterial&&oe.releaseShaderCache(w))}this.renderBufferDirect=function(w,V,K,q,j,Te){V===null&&(V=Nn);let Le=j.isMesh&&j.matrixWorld.determinantAffine()<0,Ae=$l(w,V,K,q,j);we.setMaterial(q,Le);let De=K.index,Ve=1;if(q.wireframe===!0){if(De=X.getWireframeAttribute(K),De===void 0)return;Ve=2}let et=K.drawRange,gt=K.attributes.position,ze=et.start*Ve,_t=(et.start+et.count)*Ve;Te!==null&&(ze=Math.max(ze,Te.start*Ve),_t=Math.min(_t,(Te.start+Te.count)*Ve)),De!==null?(ze=Math.max(ze,0),_t=Math.min(_t,De.count)):gt!=null&&(ze=Math.max(ze,0),_t=Math.min(_t,gt.count));let an=_t-ze;if(an<0||an===1/0)return;Se.setup(j,q,Ae,K,De);let Nt,Ut=ne;if(De!==null&&(Nt=S.get(De),Ut=Ee,Ut.setIndex(Nt)),j.isMesh)q.wireframe===!0?(we.setLineWidth(q.wireframeLinewidth*Sn()),Ut.setMode(F.LINES)):Ut.setMode(F.TRIANGLES);else if(j.isLine){let Un=q.linewidth;Un===void 0&&(Un=1),we.setLineWidth(Un*Sn()),j.isLineSegments?Ut.setMode(F.LINES):j.isLineLoop?Ut.setMode(F.LINE_LOOP):Ut.setMode(F.LINE_STRIP)}else j.isPoints?Ut.setMode(F.POINTS):j.isSprite&&Ut.setMode(F.TRIANGLES);if(j.isBatchedMesh)if(Ye.get("WEBGL_multi_draw"))Ut.renderMultiDraw(j._multiDrawStarts,j._multiDrawCounts,j._multiDrawCount);else{let Un=j._multiDrawStarts,Fe=j._multiDrawCounts,Mn=j._multiDrawCount,bt=De?S.get(De).bytesPerElement:1,ar=He.get(q).currentProgram.getUniforms();for(let wn=0;wn<Mn;wn++)ar.setValue(F,"_gl_DrawID",wn),Ut.render(Un[wn]/bt,Fe[wn])}else if(j.isInstancedMesh)Ut.renderInstances(ze,an,j.count);else if(K.isInstancedBufferGeometry){let Un=K._maxInstanceCount!==void 0?K._maxInstanceCount:1/0,Fe=Math.min(K.instanceCount,Un);Ut.renderInstances(ze,an,Fe)}else Ut.render(ze,an)};function zl(w,V,K,q){z!==null&&w.isNodeMaterial&&z.setObject(q,w),qt===!0&&ie.setState(w,K,!1),w.transparent===!0&&w.side===os&&w.forceSinglePass===!1?(w.side=Ci,w.needsUpdate=!0,Ns(w,V,q),w.side=to,w.needsUpdate=!0,Ns(w,V,q),w.side=os):Ns(w,V,q)}this.compile=function(w,V,K=null){K===null&&(K=w),z!==null&&z.renderStart(w,V,K),A=te.get(K),A.init(V),E.push(A),K.traverseVisible(function(j){j.isLight&&j.layers.test(V.layers)&&(A.pushLight(j),j.castShadow&&A.pushShadow(j))}),w!==K&&w.traverseVisible(function(j){j.isLight&&j.layers.test(V.layers)&&(A.pushLight(j),j.castShadow&&A.pushShadow(j))}),A.setupLights(),z!==null&&z.updateLights(A.state.lightsArray),bn=this.localClippingEnabled,qt=ie.init(this.clippingPlanes,bn),qt===!0&&ie.setGlobalState(this.clippingPlanes,V),z!==null&&me.render(A.state.shadowsArray,K,V);let q=new Set;return w.traverse(function(j){if(!(j.isMesh||j.isPoints||j.isLine||j.isSprite))return;let Te=j.material;if(Te)if(Array.isArray(Te))for(let Le=0;Le<Te.length;Le++){let Ae=Te[Le];zl(Ae,K,V,j),q.add(Ae)}else zl(Te,K,V,j),q.add(Te)}),A=E.pop(),z!==null&&z.renderEnd(),q},this.compileAsync=function(w,V,K=null){let q=this.compile(w,V,K);return new Promise(j=>{function Te(){if(q.forEach(function(Le){let De=He.get(Le).currentProgram;(De===void 0||De.isReady())&&q.delete(Le)}),q.size===0){j(w);return}setTimeout(Te,10)}Ye.get("KHR_parallel_shader_compile")!==null?Te():setTimeout(Te,10)})};let pa=null;function Zf(w){pa&&pa(w)}function Su(){rr.stop()}function Ds(){rr.start()}let rr=new ey;rr.setAnimationLoop(Zf),typeof self<"u"&&rr.setContext(self),this.setAnimationLoop=function(w){pa=w,le.setAnimationLoop(w),w===null?rr.stop():rr.start()},le.addEventListener("sessionstart",Su),le.addEventListener("sessionend",Ds),this.render=function(w,V){if(V!==void 0&&V.isCamera!==!0){tt("WebGLRenderer.render: camera is not an instance of THREE.Camera.");return}if(I===!0)return;z!==null&&z.renderStart(w,V);let K=le.enabled===!0&&le.isPresenting===!0,q=k!==null&&(ce===null||K)&&k.begin(U,ce);if(w.matrixWorldAutoUpdate===!0&&w.updateMatrixWorld(),V.parent===null&&V.matrixWorldAutoUpdate===!0&&V.updateMatrixWorld(),le.enabled===!0&&le.isPresenting===!0&&(k===null||k.isCompositing()===!1)&&(le.cameraAutoUpdate===!0&&le.updateCamera(V),V=le.getCamera()),w.isScene===!0&&w.onBeforeRender(U,w,V,ce),A=te.get(w,E.length),A.init(V),A.state.textureUnits=qe.getTextureUnits(),E.push(A),Bt.multiplyMatrices(V.projectionMatrix,V.matrixWorldInverse),V.isArrayCamera?nn.setFromArrayCamera(V):it.setFromProjectionMatrix(Bt,is,V.reversedDepth),bn=this.localClippingEnabled,qt=ie.init(this.clippingPlanes,bn),R=xe.get(w,v.length),R.init(),v.push(R),this.info.render.frame++,le.enabled===!0&&le.isPresenting===!0){let Le=U.xr.getDepthSensingMesh();Le!==null&&or(Le,V,-1/0,U.sortObjects)}or(w,V,0,U.sortObjects),R.finish(),z!==null&&z.updateLights(A.state.lightsArray),U.sortObjects===!0&&R.sort(We,rt),ln=le.enabled===!1||le.isPresenting===!1||le.hasDepthSensing()===!1,ln&&O.addToRenderList(R,w),this.info.autoReset===!0&&this.info.reset(),qt===!0&&ie.beginShadows();let j=A.state.shadowsArray;if(me.render(j,w,V),qt===!0&&ie.endShadows(),(q&&k.hasRenderPass())===!1){let Le=R.opaque,Ae=R.transmissive;if(A.setupLights(),V.isArrayCamera){let De=V.cameras;if(Ae.length>0)for(let Ve=0,et=De.length;Ve<et;Ve++){let gt=De[Ve];gs(Le,Ae,w,gt)}ln&&O.render(w);for(let Ve=0,et=De.length;Ve<et;Ve++){let gt=De[Ve];Vl(R,w,gt,gt.viewport)}}else Ae.length>0&&gs(Le,Ae,w,V),ln&&O.render(w),Vl(R,w,V)}ce!==null&&W===0&&(qe.updateMultisampleRenderTarget(ce),qe.updateRenderTargetMipmap(ce)),q&&k.end(U),w.isScene===!0&&w.onAfterRender(U,w,V),Se.resetDefaultState(),J=-1,Q=null,E.pop(),E.length>0?(A=E[E.length-1],qe.setTextureUnits(A.state.textureUnits),qt===!0&&ie.setGlobalState(U.clippingPlanes,A.state.camera)):A=null,v.pop(),v.length>0?R=v[v.length-1]:R=null,z!==null&&z.renderEnd()};function or(w,V,K,q){if(w.visible===!1)return;if(w.layers.test(V.layers)){if(w.isGroup)K=w.renderOrder;else if(w.isLOD)w.autoUpdate===!0&&w.update(V);else if(w.isLight)A.pushLight(w),w.castShadow&&A.pushShadow(w);else if(w.isSprite){let Le=V.isArrayCamera?nn:it;if(!w.frustumCulled||w.intersectsFrustum(Le)){q&&Mt.setFromMatrixPosition(w.matrixWorld).applyMatrix4(Bt);let Ae=ue.update(w),De=w.material;De.visible&&R.push(w,Ae,De,K,Mt.z,null,V)}}else if(w.isMesh||w.isLine||w.isPoints){let Le=V.isArrayCamera?nn:it;if(!w.frustumCulled||w.intersectsFrustum(Le)){let Ae=ue.update(w),De=w.material;if(q&&(w.boundingSphere!==void 0?(w.boundingSphere===null&&w.computeBoundingSphere(),Mt.copy(w.boundingSphere.center)):(Ae.boundingSphere===null&&Ae.computeBoundingSphere(),Mt.copy(Ae.boundingSphere.center)),Mt.applyMatrix4(w.matrixWorld).applyMatrix4(Bt)),Array.isArray(De)){let Ve=Ae.groups;for(let et=0,gt=Ve.length;et<gt;et++){let ze=Ve[et],_t=De[ze.materialIndex];_t&&_t.visible&&R.push(w,Ae,_t,K,Mt.z,ze,V)}}else De.visible&&R.push(w,Ae,De,K,Mt.z,null,V)}}}let Te=w.children;for(let Le=0,Ae=Te.length;Le<Ae;Le++)or(Te[Le],V,K,q)}function Vl(w,V,K,q){let{opaque:j,transmissive:Te,transparent:Le}=w;A.setupLightsView(K),qt===!0&&ie.setGlobalState(U.clippingPlanes,K),q&&we.viewport(se.copy(q)),j.length>0&&cn(j,V,K),Te.length>0&&cn(Te,V,K),Le.length>0&&cn(Le,V,K),we.buffers.depth.setTest(!0),we.buffers.depth.setMask(!0),we.buffers.color.setMask(!0),we.setPolygonOffset(!1)}function gs(w,V,K,q){if((K.isScene===!0?K.overrideMaterial:null)!==null)return;if(A.state.transmissionRenderTarget[q.id]===void 0){let ze=Ye.has("EXT_color_buffer_half_float")||Ye.has("EXT_color_buffer_float");A.state.transmissionRenderTarget[q.id]=new Ai(1,1,{generateMipmaps:!0,type:ze?As:di,minFilter:br,samples:Math.max(4,ot.samples),stencilBuffer:r,resolveDepthBuffer:!1,resolveStencilBuffer:!1,storeMultisampledDepthBuffer:!1,storeMultisampledStencilBuffer:!1,colorSpace:vt.workingColorSpace})}let Te=A.state.transmissionRenderTarget[q.id],Le=q.viewport||se;Te.setSize(Le.z*U.transmissionResolutionScale,Le.w*U.transmissionResolutionScale);let Ae=U.getRenderTarget(),De=U.getActiveCubeFace(),Ve=U.getActiveMipmapLevel();U.setRenderTarget(Te),U.getClearColor(ee),ge=U.getClearAlpha(),ge<1&&U.setClearColor(16777215,.5),U.clear(),ln&&O.render(K);let et=U.toneMapping;U.toneMapping=Ws;let gt=q.viewport;if(q.viewport!==void 0&&(q.viewport=void 0),A.setupLightsView(q),qt===!0&&ie.setGlobalState(U.clippingPlanes,q),cn(w,K,q),qe.updateMultisampleRenderTarget(Te),qe.updateRenderTargetMipmap(Te),Ye.has("WEBGL_multisampled_render_to_texture")===!1){let ze=!1;for(let _t=0,an=V.length;_t<an;_t++){let Nt=V[_t],{object:Ut,geometry:Un,material:Fe,group:Mn}=Nt;if(Fe.side===os&&Ut.layers.test(q.layers)){let bt=Fe.side;Fe.side=Ci,Fe.needsUpdate=!0,gn(Ut,K,q,Un,Fe,Mn),Fe.side=bt,Fe.needsUpdate=!0,ze=!0}}ze===!0&&(qe.updateMultisampleRenderTarget(Te),qe.updateRenderTargetMipmap(Te))}U.setRenderTarget(Ae,De,Ve),U.setClearColor(ee,ge),gt!==void 0&&(q.viewport=gt),U.toneMapping=et}function cn(w,V,K){let q=V.isScene===!0?V.overrideMaterial:null;for(let j=0,Te=w.length;j<Te;j++){let Le=w[j],{object:Ae,geometry:De,group:Ve}=Le,et=Le.material;et.allowOverride===!0&&q!==null&&(et=q),Ae.layers.test(K.layers)&&gn(Ae,V,K,De,et,Ve)}}function gn(w,V,K,q,j,Te){z!==null&&j.isNodeMaterial&&z.setObject(w,j),w.onBeforeRender(U,V,K,q,j,Te),w.modelViewMatrix.multiplyMatrices(K.matrixWorldInverse,w.matrixWorld),w.normalMatrix.getNormalMatrix(w.modelViewMatrix),j.onBeforeRender(U,V,K,q,w,Te),j.transparent===!0&&j.side===os&&j.forceSinglePass===!1?(j.side=Ci,j.needsUpdate=!0,U.renderBufferDirect(K,V,q,j,w,Te),j.side=to,j.needsUpdate=!0,U.renderBufferDirect(K,V,q,j,w,Te),j.side=os):U.renderBufferDirect(K,V,q,j,w,Te),w.onAfterRender(U,V,K,q,j,Te)}function _n(w){let V=0;for(let K of w)K.texture!==null&&V++;return V}function Ns(w,V,K){V.isScene!==!0&&(V=Nn);let q=He.get(w),j=A.state.lights,Te=A.state.shadowsArray,Le=j.state.version,Ae=oe.getParameters(w,j.state,Te,V,K,A.state.lightProbeGridArray),De=oe.getProgramCacheKey(Ae),Ve=q.programs;q.environment=w.isMeshStandardMaterial||w.isMeshLambertMaterial||w.isMeshPhongMaterial?V.environment:null,q.fog=V.fog;let et=w.isMeshStandardMaterial||w.isMeshLambertMaterial&&!w.envMap||w.isMeshPhongMaterial&&!w.envMap;q.envMap=C.get(w.envMap||q.environment,et),q.envMapRotation=q.environment!==null&&w.envMap===null?V.environmentRotation:w.envMapRotation,Ve===void 0&&(w.addEventListener("dispose",ct),Ve=new Map,q.programs=Ve,q.programVariants=new Map);let gt=Ve.get(De);if(gt!==void 0){if(q.currentProgram===gt&&q.lightsStateVersion===Le)return Hl(w,Ae),gt}else Ae.uniforms=oe.getUniforms(w),z!==null&&w.isNodeMaterial&&z.build(w,K,Ae),w.onBeforeCompile(Ae,U),gt=oe.acquireProgram(Ae,De),Ve.set(De,gt),q.uniforms=Ae.uniforms;let ze=q.uniforms;return(!w.isShaderMaterial&&!w.isRawShaderMaterial||w.clipping===!0)&&(ze.clippingPlanes=ie.uniform),Hl(w,Ae),q.needsLights=Fr(w),q.lightsStateVersion=Le,q.needsLights&&(ze.ambientLightColor.value=j.state.ambient,ze.lightProbe.value=j.state.probe,ze.sunLights.value=j.state.sun,ze.sunLightShadows.value=j.state.sunShadow,ze.directionalLights.value=j.state.directional,ze.directionalLightShadows.value=j.state.directionalShadow,ze.spotLights.value=j.state.spot,ze.spotLightShadows.value=j.state.spotShadow,ze.rectAreaLights.value=j.state.rectArea,ze.ltc_1.value=j.state.rectAreaLTC1,ze.ltc_2.value=j.state.rectAreaLTC2,ze.pointLights.value=j.state.point,ze.pointLightShadows.value=j.state.pointShadow,ze.hemisphereLights.value=j.state.hemi,ze.sunShadowMatrix.value=j.state.sunShadowMatrix,ze.sunShadowCascade.value=j.state.sunShadowCascade,ze.directionalShadowMatrix.value=j.state.directionalShadowMatrix,ze.spotLightMatrix.value=j.state.spotLightMatrix,ze.spotLightMap.value=j.state.spotLightMap,ze.pointShadowMatrix.value=j.state.pointShadowMatrix),q.numLightProbeGrids=_n(A.state.lightProbeGridArray),q.currentProgram=gt,q.uniformsList=null,gt}function zi(w,V,K,q,j){let Te=He.get(w),Le=Te.currentProgram.id+","+q+","+j,Ae=Te.programVariants.get(Le);return Ae===void 0?(Ae=Ns(w,V,K),Te.programVariants.set(Le,Ae)):(Te.currentProgram=Ae,Te.uniformsList=null,Te.outputColorSpace=q,Te.toneMapping=j),Ae}function Or(w){if(w.uniformsList===null){let V=w.currentProgram.getUniforms();w.uniformsList=ol.seqWithValue(V.seq,w.uniforms)}return w.uniformsList}function Hl(w,V){let K=He.get(w);K.outputColorSpace=V.outputColorSpace,K.batching=V.batching,K.batchingColor=V.batchingColor,K.instancing=V.instancing,K.instancingColor=V.instancingColor,K.instancingMorph=V.instancingMorph,K.skinning=V.skinning,K.morphTargets=V.morphTargets,K.morphNormals=V.morphNormals,K.morphColors=V.morphColors,K.morphTargetsCount=V.morphTargetsCount,K.numClippingPlanes=V.numClippingPlanes,K.numIntersection=V.numClipIntersection,K.vertexAlphas=V.vertexAlphas,K.vertexTangents=V.vertexTangents,K.toneMapping=V.toneMapping}function $l(w,V,K,q,j){V.isScene!==!0&&(V=Nn),qe.resetTextureUnits();let Te=V.fog,Le=q.isMeshStandardMaterial||q.isMeshLambertMaterial||q.isMeshPhongMaterial?V.environment:null,Ae=ce===null?U.outputColorSpace:ce.isXRRenderTarget===!0?ce.texture.colorSpace:vt.workingColorSpace,De=q.isMeshStandardMaterial||q.isMeshLambertMaterial&&!q.envMap||q.isMeshPhongMaterial&&!q.envMap,Ve=C.get(q.envMap||Le,De),et=q.vertexColors===!0&&!!K.attributes.color&&K.attributes.color.itemSize===4,gt=!!K.attributes.tangent&&(!!q.normalMap||q.anisotropy>0),ze=!!K.morphAttributes.position,_t=!!K.morphAttributes.normal,an=!!K.morphAttributes.color,Nt=Ws;q.toneMapped&&(ce===null||ce.isXRRenderTarget===!0)&&(Nt=U.toneMapping);let Ut=K.morphAttributes.position||K.morphAttributes.normal||K.morphAttributes.color,Un=Ut!==void 0?Ut.length:0,Fe=He.get(q),Mn=A.state.lights;if(qt===!0&&(bn===!0||w!==Q)){let Ot=w===Q&&q.id===J;ie.setState(q,w,Ot)}let bt=!1,ar=!1;q.version===Fe.__version?Fe.needsLights&&Fe.lightsStateVersion!==Mn.state.version||j.isBatchedMesh&&Fe.batching===!1||!j.isBatchedMesh&&Fe.batching===!0||j.isBatchedMesh&&Fe.batchingColor===!0&&j._colorsTexture===null||j.isBatchedMesh&&Fe.batchingColor===!1&&j._colorsTexture!==null||j.isInstancedMesh&&Fe.instancing===!1||!j.isInstancedMesh&&Fe.instancing===!0||j.isSkinnedMesh&&Fe.skinning===!1||!j.isSkinnedMesh&&Fe.skinning===!0||j.isInstancedMesh&&Fe.instancingColor===!0&&j.instanceColor===null||j.isInstancedMesh&&Fe.instancingColor===!1&&j.instanceColor!==null||j.isInstancedMesh&&Fe.instancingMorph===!0&&j.morphTexture===null||j.isInstancedMesh&&Fe.instancingMorph===!1&&j.morphTexture!==null||Fe.envMap!==Ve||q.fog===!0&&Fe.fog!==Te||Fe.numClippingPlanes!==void 0&&(Fe.numClippingPlanes!==ie.numPlanes||Fe.numIntersection!==ie.numIntersection)||Fe.vertexAlphas!==et||Fe.vertexTangents!==gt||Fe.morphTargets!==ze||Fe.morphNormals!==_t||Fe.morphColors!==an||Fe.morphTargetsCount!==Un||Fe.numLightProbeGrids!==_n(A.state.lightProbeGridArray)?bt=!0:(Fe.outputColorSpace!==Ae||Fe.toneMapping!==Nt)&&(ar=!0):(bt=!0,Fe.__version=q.version);let wn=Fe.currentProgram;(bt===!0||ar===!0)&&(wn=ar===!0?zi(q,V,j,Ae,Nt):Ns(q,V,j),z&&q.isNodeMaterial&&z.onUpdateProgram(q,wn,Fe));let _a=!1,Us=!1,lr=!1,ft=wn.getUniforms(),un=Fe.uniforms;if(we.useProgram(wn.program)&&(_a=!0,Us=!0,lr=!0),q.id!==J&&(J=q.id,Us=!0),_a||Q!==w){we.buffers.depth.getReversed()&&w.reversedDepth!==!0&&(w._reversedDepth=!0,w.updateProjectionMatrix()),ft.setValue(F,"projectionMatrix",w.projectionMatrix),ft.setValue(F,"viewMatrix",w.matrixWorldInverse);let En=ft.map.cameraPosition;En!==void 0&&En.setValue(F,Gn.setFromMatrixPosition(w.matrixWorld)),ot.logarithmicDepthBuffer&&ft.setValue(F,"logDepthBufFC",2/(Math.log(w.far+1)/Math.LN2)),(q.isMeshPhongMaterial||q.isMeshToonMaterial||q.isMeshLambertMaterial||q.isMeshBasicMaterial||q.isMeshStandardMaterial||q.isShaderMaterial)&&ft.setValue(F,"isOrthographic",w.isOrthographicCamera===!0),Q!==w&&(Q=w,Us=!0,lr=!0)}if(Fe.needsLights&&(Mn.state.sunShadowMap.length>0&&ft.setValue(F,"sunShadowMap",Mn.state.sunShadowMap,qe),Mn.state.directionalShadowMap.length>0&&ft.setValue(F,"directionalShadowMap",Mn.state.directionalShadowMap,qe),Mn.state.spotShadowMap.length>0&&ft.setValue(F,"spotShadowMap",Mn.state.spotShadowMap,qe),Mn.state.pointShadowMap.length>0&&ft.setValue(F,"pointShadowMap",Mn.state.pointShadowMap,qe)),j.isSkinnedMesh){ft.setOptional(F,j,"bindMatrix"),ft.setOptional(F,j,"bindMatrixInverse");let Ot=j.skeleton;Ot&&(Ot.boneTexture===null&&Ot.computeBoneTexture(),ft.setValue(F,"boneTexture",Ot.boneTexture,qe))}j.isBatchedMesh&&(ft.setOptional(F,j,"batchingTexture"),ft.setValue(F,"batchingTexture",j._matricesTexture,qe),ft.setOptional(F,j,"batchingIdTexture"),ft.setValue(F,"batchingIdTexture",j._indirectTexture,qe),ft.setOptional(F,j,"batchingColorTexture"),j._colorsTexture!==null&&ft.setValue(F,"batchingColorTexture",j._colorsTexture,qe));let xi=K.morphAttributes;if((xi.position!==void 0||xi.normal!==void 0||xi.color!==void 0)&&re.update(j,K,wn),(Us||Fe.receiveShadow!==j.receiveShadow)&&(Fe.receiveShadow=j.receiveShadow,ft.setValue(F,"receiveShadow",j.receiveShadow)),(q.isMeshStandardMaterial||q.isMeshLambertMaterial||q.isMeshPhongMaterial)&&q.envMap===null&&V.environment!==null&&(un.envMapIntensity.value=V.environmentIntensity),un.dfgLUT!==void 0&&(un.dfgLUT.value=TC()),Us){if(ft.setValue(F,"toneMappingExposure",U.toneMappingExposure),Fe.needsLights&&ma(un,lr),Te&&q.fog===!0&&ve.refreshFogUniforms(un,Te),ve.refreshMaterialUniforms(un,q,Me,Ce,A.state.transmissionRenderTarget[w.id]),Fe.needsLights&&Fe.numLightProbeGrids>0){let Ot=b,En=0;for(let li of A.state.lightProbeGridArray)li.texture!==null&&(Ot.textures[En]=li.texture,Ot.min[En]=li.boundingBox.min,Ot.max[En]=li.boundingBox.max,Ot.resolution[En]=li.resolution,En++);for(let li in Ot)Ot[li].length=En;un.probesSH.value=Ot.textures,un.probesMin.value=Ot.min,un.probesMax.value=Ot.max,un.probesResolution.value=Ot.resolution}ol.upload(F,Or(Fe),un,qe)}if(q.isShaderMaterial&&q.uniformsNeedUpdate===!0&&(ol.upload(F,Or(Fe),un,qe),q.uniformsNeedUpdate=!1),q.isSpriteMaterial&&ft.setValue(F,"center",j.center),ft.setValue(F,"modelViewMatrix",j.modelViewMatrix),ft.setValue(F,"normalMatrix",j.normalMatrix),ft.setValue(F,"modelMatrix",j.matrixWorld),q.uniformsGroups!==void 0){let Ot=q.uniformsGroups;for(let En=0,li=Ot.length;En<li;En++){let Mu=Ot[En];Ge.update(Mu,wn),Ge.bind(Mu,wn)}}return wn}function ma(w,V){w.ambientLightColor.needsUpdate=V,w.lightProbe.needsUpdate=V,w.sunLights.needsUpdate=V,w.sunLightShadows.needsUpdate=V,w.directionalLights.needsUpdate=V,w.directionalLightShadows.needsUpdate=V,w.pointLights.needsUpdate=V,w.pointLightShadows.needsUpdate=V,w.spotLights.needsUpdate=V,w.spotLightShadows.needsUpdate=V,w.rectAreaLights.needsUpdate=V,w.hemisphereLights.needsUpdate=V}function Fr(w){return w.isMeshLambertMaterial||w.isMeshToonMaterial||w.isMeshPhongMaterial||w.isMeshStandardMaterial||w.isShadowMaterial||w.isShaderMaterial&&w.lights===!0}this.getActiveCubeFace=function(){return Y},this.getActiveMipmapLevel=function(){return W},this.getRenderTarget=function(){return ce},this.setRenderTargetTextures=function(w,V,K){let q=He.get(w);q.__autoAllocateDepthBuffer=w.resolveDepthBuffer===!1,q.__autoAllocateDepthBuffer===!1&&(q.__useRenderToTexture=!1),He.get(w.texture).__webglTexture=V,He.get(w.depthTexture).__webglTexture=q.__autoAllocateDepthBuffer?void 0:K,q.__hasExternalTextures=!0},this.setRenderTargetFramebuffer=function(w,V){let K=He.get(w);K.__webglFramebuffer=V,K.__useDefaultFramebuffer=V===void 0},this.setRenderTarget=function(w,V=0,K=0){ce=w,Y=V,W=K;let q=null,j=!1,Te=!1;if(w){let Ae=He.get(w);if(Ae.__useDefaultFramebuffer!==void 0){we.bindFramebuffer(F.FRAMEBUFFER,Ae.__webglFramebuffer),se.copy(w.viewport),de.copy(w.scissor),he=w.scissorTest,we.viewport(se),we.scissor(de),we.setScissorTest(he),J=-1;return}else if(Ae.__webglFramebuffer===void 0)qe.setupRenderTarget(w);else if(Ae.__hasExternalTextures)qe.rebindTextures(w,He.get(w.texture).__webglTexture,He.get(w.depthTexture).__webglTexture);else if(w.depthBuffer){let et=w.depthTexture;if(Ae.__boundDepthTexture!==et){if(et!==null&&He.has(et)&&(w.width!==et.image.width||w.height!==et.image.height))throw new Error("THREE.WebGLRenderer: Attached DepthTexture is initialized to the incorrect size.");qe.setupDepthRenderbuffer(w)}}let De=w.texture;(De.isData3DTexture||De.isDataArrayTexture||De.isCompressedArrayTexture)&&(Te=!0);let Ve=He.get(w).__webglFramebuffer;w.isWebGLCubeRenderTarget?(Array.isArray(Ve[V])?q=Ve[V][K]:q=Ve[V],j=!0):w.samples>0&&qe.useMultisampledRTT(w)===!1?q=He.get(w).__webglMultisampledFramebuffer:Array.isArray(Ve)?q=Ve[K]:q=Ve,se.copy(w.viewport),de.copy(w.scissor),he=w.scissorTest}else se.copy($e).multiplyScalar(Me).floor(),de.copy(mt).multiplyScalar(Me).floor(),he=dt;if(K!==0&&(q=H),we.bindFramebuffer(F.FRAMEBUFFER,q)&&we.drawBuffers(w,q),we.viewport(se),we.scissor(de),we.setScissorTest(he),j){let Ae=He.get(w.texture);F.framebufferTexture2D(F.FRAMEBUFFER,F.COLOR_ATTACHMENT0,F.TEXTURE_CUBE_MAP_POSITIVE_X+V,Ae.__webglTexture,K)}else if(Te){let Ae=V;for(let De=0;De<w.textures.length;De++){let Ve=He.get(w.textures[De]);F.framebufferTextureLayer(F.FRAMEBUFFER,F.COLOR_ATTACHMENT0+De,Ve.__webglTexture,K,Ae)}}else if(w!==null&&K!==0){let Ae=He.get(w.texture);F.framebufferTexture2D(F.FRAMEBUFFER,F.COLOR_ATTACHMENT0,F.TEXTURE_2D,Ae.__webglTexture,K)}J=-1};function ga(w){let V=He.get(w);return(V.__readFormat!==w.format||V.__readType!==w.type)&&(V.__readFormat=w.format,V.__readType=w.type,V.__formatReadable=ot.textureFormatReadable(w.format),V.__typeReadable=ot.textureTypeReadable(w.type)),V}this.readRenderTargetPixels=function(w,V,K,q,j,Te,Le,Ae=0){if(!(w&&w.isWebGLRenderTarget)){tt("WebGLRenderer.readRenderTargetPixels: renderTarget is not THREE.WebGLRenderTarget.");return}let De=He.get(w).__webglFramebuffer;if(w.isWebGLCubeRenderTarget&&Le!==void 0&&(De=De[Le],Array.isArray(De)&&(De=De[0])),De){we.bindFramebuffer(F.FRAMEBUFFER,De);try{let Ve=w.textures[Ae],et=Ve.format,gt=Ve.type;w.textures.length>1&&F.readBuffer(F.COLOR_ATTACHMENT0+Ae);let ze=ga(Ve);if(ze.__formatReadable===!1){tt("WebGLRenderer.readRenderTargetPixels: renderTarget is not in RGBA or implementation defined format.");return}if(ze.__typeReadable===!1){tt("WebGLRenderer.readRenderTargetPixels: renderTarget is not in UnsignedByteType or implementation defined type.");return}V>=0&&V<=w.width-q&&K>=0&&K<=w.height-j&&F.readPixels(V,K,q,j,_e.convert(et),_e.convert(gt),Te)}finally{let Ve=ce!==null?He.get(ce).__webglFramebuffer:null;we.bindFramebuffer(F.FRAMEBUFFER,Ve)}}},this.readRenderTargetPixelsAsync=async function(w,V,K,q,j,Te,Le,Ae=0){if(!(w&&w.isWebGLRenderTarget))throw new Error("THREE.WebGLRenderer.readRenderTargetPixels: renderTarget is not THREE.WebGLRenderTarget.");let De=He.get(w).__webglFramebuffer;if(w.isWebGLCubeRenderTarget&&Le!==void 0&&(De=De[Le],Array.isArray(De)&&(De=De[0])),De)if(V>=0&&V<=w.width-q&&K>=0&&K<=w.height-j){we.bindFramebuffer(F.FRAMEBUFFER,De);let Ve=w.textures[Ae],et=Ve.format,gt=Ve.type;w.textures.length>1&&F.readBuffer(F.COLOR_ATTACHMENT0+Ae);let ze=ga(Ve);if(ze.__formatReadable===!1)throw new Error("THREE.WebGLRenderer.readRenderTargetPixelsAsync: renderTarget is not in RGBA or implementation defined format.");if(ze.__typeReadable===!1)throw new Error("THREE.WebGLRenderer.readRenderTargetPixelsAsync: renderTarget is not in UnsignedByteType or implementation defined type.");let _t=F.createBuffer();F.bindBuffer(F.PIXEL_PACK_BUFFER,_t),F.bufferData(F.PIXEL_PACK_BUFFER,Te.byteLength,F.STREAM_READ),F.readPixels(V,K,q,j,_e.convert(et),_e.convert(gt),0),F.bindBuffer(F.PIXEL_PACK_BUFFER,null);let an=ce!==null?He.get(ce).__webglFramebuffer:null;we.bindFramebuffer(F.FRAMEBUFFER,an);let Nt=F.fenceSync(F.SYNC_GPU_COMMANDS_COMPLETE,0);return F.flush(),await Cv(F,Nt,4),F.bindBuffer(F.PIXEL_PACK_BUFFER,_t),F.getBufferSubData(F.PIXEL_PACK_BUFFER,0,Te),F.bindBuffer(F.PIXEL_PACK_BUFFER,null),F.deleteBuffer(_t),F.deleteSync(Nt),Te}else throw new Error("THREE.WebGLRenderer.readRenderTargetPixelsAsync: requested read bounds are out of range.")},this.copyFramebufferToTexture=function(w,V=null,K=0){let q=Math.pow(2,-K),j=Math.floor(w.image.width*q),Te=Math.floor(w.image.height*q),Le=V!==null?V.x:0,Ae=V!==null?V.y:0;qe.setTexture2D(w,0),F.copyTexSubImage2D(F.TEXTURE_2D,K,0,0,Le,Ae,j,Te),we.unbindTexture()},this.copyTextureToTexture=function(w,V,K=null,q=null,j=0,Te=0){let Le,Ae,De,Ve,et,gt,ze,_t,an,Nt=w.isCompressedTexture?w.mipmaps[Te]:w.image;if(K!==null)Le=K.max.x-K.min.x,Ae=K.max.y-K.min.y,De=K.isBox3?K.max.z-K.min.z:1,Ve=K.min.x,et=K.min.y,gt=K.isBox3?K.min.z:0;else{let ft=Math.pow(2,-j);Le=Math.floor(Nt.width*ft),Ae=Math.floor(Nt.height*ft),w.isDataArrayTexture?De=Nt.depth:w.isData3DTexture?De=Math.floor(Nt.depth*ft):De=1,Ve=0,et=0,gt=0}q!==null?(ze=q.x,_t=q.y,an=q.z):(ze=0,_t=0,an=0);let Ut=_e.convert(V.format),Un=_e.convert(V.type),Fe;V.isData3DTexture?(qe.setTexture3D(V,0),Fe=F.TEXTURE_3D):V.isDataArrayTexture||V.isCompressedArrayTexture?(qe.setTexture2DArray(V,0),Fe=F.TEXTURE_2D_ARRAY):(qe.setTexture2D(V,0),Fe=F.TEXTURE_2D),we.activeTexture(F.TEXTURE0),we.pixelStorei(F.UNPACK_FLIP_Y_WEBGL,V.flipY),we.pixelStorei(F.UNPACK_PREMULTIPLY_ALPHA_WEBGL,V.premultiplyAlpha),we.pixelStorei(F.UNPACK_ALIGNMENT,V.unpackAlignment);let Mn=we.getParameter(F.UNPACK_ROW_LENGTH),bt=we.getParameter(F.UNPACK_IMAGE_HEIGHT),ar=we.getParameter(F.UNPACK_SKIP_PIXELS),wn=we.getParameter(F.UNPACK_SKIP_ROWS),_a=we.getParameter(F.UNPACK_SKIP_IMAGES);we.pixelStorei(F.UNPACK_ROW_LENGTH,Nt.width),we.pixelStorei(F.UNPACK_IMAGE_HEIGHT,Nt.height),we.pixelStorei(F.UNPACK_SKIP_PIXELS,Ve),we.pixelStorei(F.UNPACK_SKIP_ROWS,et),we.pixelStorei(F.UNPACK_SKIP_IMAGES,gt);let Us=w.isDataArrayTexture||w.isData3DTexture,lr=V.isDataArrayTexture||V.isData3DTexture;if(w.isDepthTexture){let ft=He.get(w),un=He.get(V),xi=He.get(ft.__renderTarget),Ot=He.get(un.__renderTarget);we.bindFramebuffer(F.READ_FRAMEBUFFER,xi.__webglFramebuffer),we.bindFramebuffer(F.DRAW_FRAMEBUFFER,Ot.__webglFramebuffer);for(let En=0;En<De;En++)Us&&(F.framebufferTextureLayer(F.READ_FRAMEBUFFER,F.COLOR_ATTACHMENT0,He.get(w).__webglTexture,j,gt+En),F.framebufferTextureLayer(F.DRAW_FRAMEBUFFER,F.COLOR_ATTACHMENT0,He.get(V).__webglTexture,Te,an+En)),F.blitFramebuffer(Ve,et,Ve+Le,et+Ae,ze,_t,ze+Le,_t+Ae,F.DEPTH_BUFFER_BIT,F.NEAREST);we.bindFramebuffer(F.READ_FRAMEBUFFER,null),we.bindFramebuffer(F.DRAW_FRAMEBUFFER,null)}else if(j!==0||w.isRenderTargetTexture||He.has(w)){let ft=He.get(w),un=He.get(V);we.bindFramebuffer(F.READ_FRAMEBUFFER,N),we.bindFramebuffer(F.DRAW_FRAMEBUFFER,G);for(let xi=0;xi<De;xi++)Us?F.framebufferTextureLayer(F.READ_FRAMEBUFFER,F.COLOR_ATTACHMENT0,ft.__webglTexture,j,gt+xi):F.framebufferTexture2D(F.READ_FRAMEBUFFER,F.COLOR_ATTACHMENT0,F.TEXTURE_2D,ft.__webglTexture,j),lr?F.framebufferTextureLayer(F.DRAW_FRAMEBUFFER,F.COLOR_ATTACHMENT0,un.__webglTexture,Te,an+xi):F.framebufferTexture2D(F.DRAW_FRAMEBUFFER,F.COLOR_ATTACHMENT0,F.TEXTURE_2D,un.__webglTexture,Te),j!==0?F.blitFramebuffer(Ve,et,Ve+Le,et+Ae,ze,_t,ze+Le,_t+Ae,F.COLOR_BUFFER_BIT,F.NEAREST):lr?F.copyTexSubImage3D(Fe,Te,ze,_t,an+xi,Ve,et,Le,Ae):F.copyTexSubImage2D(Fe,Te,ze,_t,Ve,et,Le,Ae);we.bindFramebuffer(F.READ_FRAMEBUFFER,null),we.bindFramebuffer(F.DRAW_FRAMEBUFFER,null)}else lr?w.isDataTexture||w.isData3DTexture?F.texSubImage3D(Fe,Te,ze,_t,an,Le,Ae,De,Ut,Un,Nt.data):V.isCompressedArrayTexture?F.compressedTexSubImage3D(Fe,Te,ze,_t,an,Le,Ae,De,Ut,Nt.data):F.texSubImage3D(Fe,Te,ze,_t,an,Le,Ae,De,Ut,Un,Nt):w.isDataTexture?F.texSubImage2D(F.TEXTURE_2D,Te,ze,_t,Le,Ae,Ut,Un,Nt.data):w.isCompressedTexture?F.compressedTexSubImage2D(F.TEXTURE_2D,Te,ze,_t,Nt.width,Nt.height,Ut,Nt.data):F.texSubImage2D(F.TEXTURE_2D,Te,ze,_t,Le,Ae,Ut,Un,Nt);we.pixelStorei(F.UNPACK_ROW_LENGTH,Mn),we.pixelStorei(F.UNPACK_IMAGE_HEIGHT,bt),we.pixelStorei(F.UNPACK_SKIP_PIXELS,ar),we.pixelStorei(F.UNPACK_SKIP_ROWS,wn),we.pixelStorei(F.UNPACK_SKIP_IMAGES,_a),Te===0&&V.generateMipmaps===!0&&V.mipmapsAutoUpdate===!0&&F.generateMipmap(Fe),we.unbindTexture()},this.initRenderTarget=function(w){He.get(w).__webglFramebuffer===void 0&&qe.setupRenderTarget(w)},this.initTexture=function(w){w.isCubeTexture?qe.setTextureCube(w,0):w.isData3DTexture?qe.setTexture3D(w,0):w.isDataArrayTexture||w.isCompressedArrayTexture?qe.setTexture2DArray(w,0):qe.setTexture2D(w,0),we.unbindTexture()},this.resetState=function(){Y=0,W=0,ce=null,we.reset(),Se.reset()},typeof __THREE_DEVTOOLS__<"u"&&__THREE_DEVTOOLS__.dispatchEvent(new CustomEvent("observe",{detail:this}))}get coordinateSystem(){return is}get outputColorSpace(){return this._outputColorSpace}set outputColorSpace(e){this._outputColorSpace=e;let t=this.getContext();t.drawingBufferColorSpace=vt._getDrawingBufferColorSpace(e),t.unpackColorSpace=vt._getUnpackColorSpace()}};var hy=new Fn,Vd=new B,qo=class extends Nc{constructor(){super(),this.isLineSegmentsGeometry=!0,this.type="LineSegmentsGeometry";let e=[-1,2,0,1,2,0,-1,1,0,1,1,0,-1,0,0,1,0,0,-1,-1,0,1,-1,0],t=[-1,2,1,2,-1,1,1,1,-1,-1,1,-1,-1,-2,1,-2],i=[0,2,1,2,3,1,2,4,3,4,5,3,4,6,5,6,7,5];this.setIndex(i),this.setAttribute("position",new pn(e,3)),this.setAttribute("uv",new pn(t,2))}applyMatrix4(e){let t=this.attributes.instanceStart,i=this.attributes.instanceEnd;return t!==void 0&&(t.applyMatrix4(e),i.applyMatrix4(e),t.needsUpdate=!0),this.boundingBox!==null&&this.computeBoundingBox(),this.boundingSphere!==null&&this.computeBoundingSphere(),this}setPositions(e){let t;e instanceof Float32Array?t=e:Array.isArray(e)&&(t=new Float32Array(e));let i=new eo(t,6,1);return this.setAttribute("instanceStart",new ws(i,3,0)),this.setAttribute("instanceEnd",new ws(i,3,3)),this.instanceCount=this.attributes.instanceStart.count,this.computeBoundingBox(),this.computeBoundingSphere(),this}setColors(e){let t;e instanceof Float32Array?t=e:Array.isArray(e)&&(t=new Float32Array(e));let i=new eo(t,6,1);return this.setAttribute("instanceColorStart",new ws(i,3,0)),this.setAttribute("instanceColorEnd",new ws(i,3,3)),this}fromWireframeGeometry(e){return this.setPositions(e.attributes.position.array),this}fromEdgesGeometry(e){return this.setPositions(e.attributes.position.array),this}fromMesh(e){return this.fromWireframeGeometry(new Cc(e.geometry)),this}fromLineSegments(e){let t=e.geometry;return this.setPositions(t.attributes.position.array),this}computeBoundingBox(){this.boundingBox===null&&(this.boundingBox=new Fn);let e=this.attributes.instanceStart,t=this.attributes.instanceEnd;e!==void 0&&t!==void 0&&(this.boundingBox.setFromBufferAttribute(e),hy.setFromBufferAttribute(t),this.boundingBox.union(hy))}computeBoundingSphere(){this.boundingSphere===null&&(this.boundingSphere=new Pn),this.boundingBox===null&&this.computeBoundingBox();let e=this.attributes.instanceStart,t=this.attributes.instanceEnd;if(e!==void 0&&t!==void 0){let i=this.boundingSphere.center;this.boundingBox.getCenter(i);let s=0;for(let r=0,o=e.count;r<o;r++)Vd.fromBufferAttribute(e,r),s=Math.max(s,i.distanceToSquared(Vd)),Vd.fromBufferAttribute(t,r),s=Math.max(s,i.distanceToSquared(Vd));this.boundingSphere.radius=Math.sqrt(s),isNaN(this.boundingSphere.radius)&&console.error("THREE.LineSegmentsGeometry.computeBoundingSphere(): Computed radius is NaN. The instanced position data is likely to have NaN values.",this)}}toJSON(){}};Ie.line={worldUnits:{value:1},linewidth:{value:1},resolution:{value:new at},dashOffset:{value:0},dashScale:{value:1},dashSize:{value:1},gapSize:{value:1}};Ri.line={uniforms:Gc.merge([Ie.common,Ie.fog,Ie.line]),vertexShader:`
		#include <common>
		#include <color_pars_vertex>
		#include <fog_pars_vertex>
		#include <logdepthbuf_pars_vertex>
		#include <clipping_planes_pars_vertex>

		uniform float linewidth;
		uniform vec2 resolution;

		attribute vec3 instanceStart;
		attribute vec3 instanceEnd;

		attribute vec3 instanceColorStart;
		attribute vec3 instanceColorEnd;

		#ifdef WORLD_UNITS

			varying vec4 worldPos;
			varying vec3 worldStart;
			varying vec3 worldEnd;

			#ifdef USE_DASH

				varying vec2 vUv;

			#endif

		#else

			varying vec2 vUv;

		#endif

		#ifdef USE_DASH

			uniform float dashScale;
			attribute float instanceDistanceStart;
			attribute float instanceDistanceEnd;
			varying float vLineDistance;

		#endif

		float trimSegmentAlpha( const in vec4 start, const in vec4 end ) {

			// compute the interpolation factor needed to trim the segment so it terminates
			// between the camera plane and the near plane

			// conservative estimate of the near plane
			float a = projectionMatrix[ 2 ][ 2 ]; // 3nd entry in 3th column
			float b = projectionMatrix[ 3 ][ 2 ]; // 3nd entry in 4th column

			// we need different nearEstimate formula for reversed and default depth buffer
			// a is positive with a reversed depth buffer so it can be used for controlling the code flow
			float nearEstimate = ( a > 0.0 ) ? ( - b / ( a + 1.0 ) ) : ( - 0.5 * b / a );

			return ( nearEstimate - start.z ) / ( end.z - start.z );

		}

		void main() {

			#ifdef USE_COLOR

				vColor.xyz = ( position.y < 0.5 ) ? instanceColorStart : instanceColorEnd;

			#endif

			float aspect = resolution.x / resolution.y;

			// camera space
			vec4 start = modelViewMatrix * vec4( instanceStart, 1.0 );
			vec4 end = modelViewMatrix * vec4( instanceEnd, 1.0 );

			#ifdef USE_DASH

				float lineDistanceStart = dashScale * instanceDistanceStart;
				float lineDistanceEnd = dashScale * instanceDistanceEnd;

			#endif

			#ifdef WORLD_UNITS

				worldStart = start.xyz;
				worldEnd = end.xyz;

			#else

				vUv = uv;

			#endif

			// special case for perspective projection, and segments that terminate either in, or behind, the camera plane
			// clearly the gpu firmware has a way of addressing this issue when projecting into ndc space
			// but we need to perform ndc-space calculations in the shader, so we must address this issue directly
			// perhaps there is a more elegant solution -- WestLangley

			bool perspective = ( projectionMatrix[ 2 ][ 3 ] == - 1.0 ); // 4th entry in the 3rd column

			if ( perspective ) {

				if ( start.z < 0.0 && end.z >= 0.0 ) {

					float alpha = trimSegmentAlpha( start, end );
					end.xyz = mix( start.xyz, end.xyz, alpha );

					#ifdef USE_DASH

						lineDistanceEnd = mix( lineDistanceStart, lineDistanceEnd, alpha );

					#endif

				} else if ( end.z < 0.0 && start.z >= 0.0 ) {

					float alpha = trimSegmentAlpha( end, start );
					start.xyz = mix( end.xyz, start.xyz, alpha );

					#ifdef USE_DASH

						lineDistanceStart = mix( lineDistanceEnd, lineDistanceStart, alpha );

					#endif

				}

			}

			#ifdef USE_DASH

				vLineDistance = ( position.y < 0.5 ) ? lineDistanceStart : lineDistanceEnd;
				vUv = uv;

			#endif

			// clip space
			vec4 clipStart = projectionMatrix * start;
			vec4 clipEnd = projectionMatrix * end;

			// ndc space
			vec3 ndcStart = clipStart.xyz / clipStart.w;
			vec3 ndcEnd = clipEnd.xyz / clipEnd.w;

			// direction
			vec2 dir = ndcEnd.xy - ndcStart.xy;

			// account for clip-space aspect ratio
			dir.x *= aspect;
			dir = normalize( dir );

			#ifdef WORLD_UNITS

				vec3 worldDir = normalize( end.xyz - start.xyz );
				vec3 tmpFwd = perspective ? normalize( mix( start.xyz, end.xyz, 0.5 ) ) : vec3( 0.0, 0.0, - 1.0 );
				vec3 worldUp = normalize( cross( worldDir, tmpFwd ) );
				vec3 worldFwd = cross( worldDir, worldUp );
				worldPos = position.y < 0.5 ? start: end;

				// height offset
				float hw = linewidth * 0.5;
				worldPos.xyz += position.x < 0.0 ? hw * worldUp : - hw * worldUp;

				// don't extend the line if we're rendering dashes because we
				// won't be rendering the endcaps
				#ifndef USE_DASH

					// cap extension
					worldPos.xyz += position.y < 0.5 ? - hw * worldDir : hw * worldDir;

					// add width to the box
					worldPos.xyz += worldFwd * hw;

					// endcaps
					if ( position.y > 1.0 || position.y < 0.0 ) {

						worldPos.xyz -= worldFwd * 2.0 * hw;

					}

				#endif

				// project the worldpos
				vec4 clip = projectionMatrix * worldPos;

				// shift the depth of the projected points so the line
				// segments overlap neatly
				vec3 clipPose = ( position.y < 0.5 ) ? ndcStart : ndcEnd;

				// only shift the depth of vertices in front of the camera (#35137)
				if ( clip.w > 0.0 ) clip.z = clipPose.z * clip.w;

			#else

				vec2 offset = vec2( dir.y, - dir.x );
				// undo aspect ratio adjustment
				dir.x /= aspect;
				offset.x /= aspect;

				// sign flip
				if ( position.x < 0.0 ) offset *= - 1.0;

				// endcaps
				if ( position.y < 0.0 ) {

					offset += - dir;

				} else if ( position.y > 1.0 ) {

					offset += dir;

				}

				// adjust for linewidth
				offset *= linewidth;

				// adjust for clip-space to screen-space conversion // maybe resolution should be based on viewport ...
				offset /= resolution.y;

				// select end
				vec4 clip = ( position.y < 0.5 ) ? clipStart : clipEnd;

				// back to clip space
				offset *= clip.w;

				clip.xy += offset;

			#endif

			gl_Position = clip;

			vec4 mvPosition = ( position.y < 0.5 ) ? start : end; // this is an approximation

			#include <logdepthbuf_vertex>
			#include <clipping_planes_vertex>
			#include <fog_vertex>

		}
		`,fragmentShader:`
		uniform vec3 diffuse;
		uniform float opacity;
		uniform float linewidth;

		#ifdef USE_DASH

			uniform float dashOffset;
			uniform float dashSize;
			uniform float gapSize;

		#endif

		varying float vLineDistance;

		#ifdef WORLD_UNITS

			varying vec4 worldPos;
			varying vec3 worldStart;
			varying vec3 worldEnd;

			#ifdef USE_DASH

				varying vec2 vUv;

			#endif

		#else

			varying vec2 vUv;

		#endif

		#include <common>
		#include <color_pars_fragment>
		#include <fog_pars_fragment>
		#include <logdepthbuf_pars_fragment>
		#include <clipping_planes_pars_fragment>

		vec2 closestLineToLine(vec3 p1, vec3 p2, vec3 p3, vec3 p4) {

			float mua;
			float mub;

			vec3 p13 = p1 - p3;
			vec3 p43 = p4 - p3;

			vec3 p21 = p2 - p1;

			float d1343 = dot( p13, p43 );
			float d4321 = dot( p43, p21 );
			float d1321 = dot( p13, p21 );
			float d4343 = dot( p43, p43 );
			float d2121 = dot( p21, p21 );

			float denom = d2121 * d4343 - d4321 * d4321;

			float numer = d1343 * d4321 - d1321 * d4343;

			mua = numer / denom;
			mua = clamp( mua, 0.0, 1.0 );
			mub = ( d1343 + d4321 * ( mua ) ) / d4343;
			mub = clamp( mub, 0.0, 1.0 );

			return vec2( mua, mub );

		}

		void main() {

			float alpha = opacity;
			vec4 diffuseColor = vec4( diffuse, alpha );

			#include <clipping_planes_fragment>

			#ifdef USE_DASH

				if ( vUv.y < - 1.0 || vUv.y > 1.0 ) discard; // discard endcaps

				if ( mod( vLineDistance + dashOffset, dashSize + gapSize ) > dashSize ) discard; // todo - FIX

			#endif

			#ifdef WORLD_UNITS

				float len;

				if ( isOrthographic ) {

					// View rays are parallel to the z axis so the distance reduces to camera-space XY
					vec2 lineDir = worldEnd.xy - worldStart.xy;
					float t = clamp( dot( worldPos.xy - worldStart.xy, lineDir ) / dot( lineDir, lineDir ), 0.0, 1.0 );
					len = length( worldStart.xy + lineDir * t - worldPos.xy );

				} else {

					// Find the closest points on the view ray and the line segment
					vec3 rayEnd = normalize( worldPos.xyz ) * 1e5;
					vec3 lineDir = worldEnd - worldStart;
					vec2 params = closestLineToLine( worldStart, worldEnd, vec3( 0.0, 0.0, 0.0 ), rayEnd );

					vec3 p1 = worldStart + lineDir * params.x;
					vec3 p2 = rayEnd * params.y;
					vec3 delta = p1 - p2;
					len = length( delta );

				}

				float norm = len / linewidth;

				#ifndef USE_DASH

					#ifdef USE_ALPHA_TO_COVERAGE

						float dnorm = fwidth( norm );
						alpha = 1.0 - smoothstep( 0.5 - dnorm, 0.5 + dnorm, norm );

					#else

						if ( norm > 0.5 ) {

							discard;

						}

					#endif

				#endif

			#else

				#ifdef USE_ALPHA_TO_COVERAGE

					// artifacts appear on some hardware if a derivative is taken within a conditional
					float a = vUv.x;
					float b = ( vUv.y > 0.0 ) ? vUv.y - 1.0 : vUv.y + 1.0;
					float len2 = a * a + b * b;
					float dlen = fwidth( len2 );

					if ( abs( vUv.y ) > 1.0 ) {

						alpha = 1.0 - smoothstep( 1.0 - dlen, 1.0 + dlen, len2 );

					}

				#else

					if ( abs( vUv.y ) > 1.0 ) {

						float a = vUv.x;
						float b = ( vUv.y > 0.0 ) ? vUv.y - 1.0 : vUv.y + 1.0;
						float len2 = a * a + b * b;

						if ( len2 > 1.0 ) discard;

					}

				#endif

			#endif

			#include <logdepthbuf_fragment>
			#include <color_fragment>

			gl_FragColor = vec4( diffuseColor.rgb, alpha );

			#include <tonemapping_fragment>
			#include <colorspace_fragment>
			#include <fog_fragment>
			#include <premultiplied_alpha_fragment>

		}
		`};var cl=class extends hi{constructor(e){super({type:"LineMaterial",uniforms:Gc.clone(Ri.line.uniforms),vertexShader:Ri.line.vertexShader,fragmentShader:Ri.line.fragmentShader,clipping:!0}),this.isLineMaterial=!0,this.setValues(e)}get color(){return this.uniforms.diffuse.value}set color(e){this.uniforms.diffuse.value=e}get worldUnits(){return"WORLD_UNITS"in this.defines}set worldUnits(e){e===!0!==this.worldUnits&&(this.needsUpdate=!0),e===!0?this.defines.WORLD_UNITS="":delete this.defines.WORLD_UNITS}get linewidth(){return this.uniforms.linewidth.value}set linewidth(e){this.uniforms.linewidth&&(this.uniforms.linewidth.value=e)}get dashed(){return"USE_DASH"in this.defines}set dashed(e){e===!0!==this.dashed&&(this.needsUpdate=!0),e===!0?this.defines.USE_DASH="":delete this.defines.USE_DASH}get dashScale(){return this.uniforms.dashScale.value}set dashScale(e){this.uniforms.dashScale.value=e}get dashSize(){return this.uniforms.dashSize.value}set dashSize(e){this.uniforms.dashSize.value=e}get dashOffset(){return this.uniforms.dashOffset.value}set dashOffset(e){this.uniforms.dashOffset.value=e}get gapSize(){return this.uniforms.gapSize.value}set gapSize(e){this.uniforms.gapSize.value=e}get opacity(){return this.uniforms.opacity.value}set opacity(e){this.uniforms&&(this.uniforms.opacity.value=e)}get resolution(){return this.uniforms.resolution.value}set resolution(e){this.uniforms.resolution.value.copy(e)}get alphaToCoverage(){return"USE_ALPHA_TO_COVERAGE"in this.defines}set alphaToCoverage(e){this.defines&&(e===!0!==this.alphaToCoverage&&(this.needsUpdate=!0),e===!0?this.defines.USE_ALPHA_TO_COVERAGE="":delete this.defines.USE_ALPHA_TO_COVERAGE)}};var Xm=new It,dy=new B,fy=new B,ni=new It,ii=new It,qs=new It,qm=new B,Ym=new ht,si=new Uc,py=new B,Hd=new Fn,$d=new Pn,Ys=new It,js,Yo;function my(n,e,t){return Ys.set(0,0,-e,1).applyMatrix4(n.projectionMatrix),Ys.multiplyScalar(1/Ys.w),Ys.x=Yo/t.width,Ys.y=Yo/t.height,Ys.applyMatrix4(n.projectionMatrixInverse),Ys.multiplyScalar(1/Ys.w),Math.abs(Math.max(Ys.x,Ys.y))}function AC(n,e){let t=n.matrixWorld,i=n.geometry,s=i.attributes.instanceStart,r=i.attributes.instanceEnd,o=Math.min(i.instanceCount,s.count);for(let a=0,l=o;a<l;a++){si.start.fromBufferAttribute(s,a),si.end.fromBufferAttribute(r,a),si.applyMatrix4(t);let c=new B,u=new B;js.distanceSqToSegment(si.start,si.end,u,c),u.distanceTo(c)<Yo*.5&&e.push({point:u,pointOnLine:c,distance:js.origin.distanceTo(u),object:n,face:null,faceIndex:a,uv:null,uv1:null})}}function CC(n,e,t){let i=e.projectionMatrix,r=n.material.resolution,o=n.matrixWorld,a=n.geometry,l=a.attributes.instanceStart,c=a.attributes.instanceEnd,u=Math.min(a.instanceCount,l.count),h=-e.near;js.at(1,qs),qs.w=1,qs.applyMatrix4(e.matrixWorldInverse),qs.applyMatrix4(i),qs.multiplyScalar(1/qs.w),qs.x*=r.x/2,qs.y*=r.y/2,qs.z=0,qm.copy(qs),Ym.multiplyMatrices(e.matrixWorldInverse,o);for(let d=0,f=u;d<f;d++){if(ni.fromBufferAttribute(l,d),ii.fromBufferAttribute(c,d),ni.w=1,ii.w=1,ni.applyMatrix4(Ym),ii.applyMatrix4(Ym),ni.z>h&&ii.z>h)continue;if(ni.z>h){let T=ni.z-ii.z,b=(ni.z-h)/T;ni.lerp(ii,b)}else if(ii.z>h){let T=ii.z-ni.z,b=(ii.z-h)/T;ii.lerp(ni,b)}ni.applyMatrix4(i),ii.applyMatrix4(i),ni.multiplyScalar(1/ni.w),ii.multiplyScalar(1/ii.w),ni.x*=r.x/2,ni.y*=r.y/2,ii.x*=r.x/2,ii.y*=r.y/2,si.start.copy(ni),si.start.z=0,si.end.copy(ii),si.end.z=0;let y=si.closestPointToPointParameter(qm,!0);si.at(y,py);let g=Im.lerp(ni.z,ii.z,y),p=g>=-1&&g<=1,x=qm.distanceTo(py)<Yo*.5;if(p&&x){si.start.fromBufferAttribute(l,d),si.end.fromBufferAttribute(c,d),si.start.applyMatrix4(o),si.end.applyMatrix4(o);let T=new B,b=new B;js.distanceSqToSegment(si.start,si.end,b,T),t.push({point:b,pointOnLine:T,distance:js.origin.distanceTo(b),object:n,face:null,faceIndex:d,uv:null,uv1:null})}}}var Gd=class extends Zn{constructor(e=new qo,t=new cl({color:Math.random()*16777215})){super(e,t),this.isLineSegments2=!0,this.type="LineSegments2"}computeLineDistances(){let e=this.geometry,t=e.attributes.instanceStart,i=e.attributes.instanceEnd,s=new Float32Array(2*t.count);for(let o=0,a=0,l=t.count;o<l;o++,a+=2)dy.fromBufferAttribute(t,o),fy.fromBufferAttribute(i,o),s[a]=a===0?0:s[a-1],s[a+1]=s[a]+dy.distanceTo(fy);let r=new eo(s,2,1);return e.setAttribute("instanceDistanceStart",new ws(r,1,0)),e.setAttribute("instanceDistanceEnd",new ws(r,1,1)),this}raycast(e,t){let i=this.material.worldUnits,s=e.camera;if(s===null&&!i&&console.error('LineSegments2: "Raycaster.camera" needs to be set in order to raycast against LineSegments2 while worldUnits is set to false.'),i===!1&&(this.material.resolution.x===0||this.material.resolution.y===0))return;let r=e.params.Line2!==void 0&&e.params.Line2.threshold||0;js=e.ray;let o=this.matrixWorld,a=this.geometry,l=this.material;Yo=l.linewidth+r,a.boundingSphere===null&&a.computeBoundingSphere(),$d.copy(a.boundingSphere).applyMatrix4(o);let c;if(i)c=Yo*.5;else{let h=Math.max(s.near,$d.distanceToPoint(js.origin));c=my(s,h,l.resolution)}if($d.radius+=c,js.intersectsSphere($d)===!1)return;a.boundingBox===null&&a.computeBoundingBox(),Hd.copy(a.boundingBox).applyMatrix4(o);let u;if(i)u=Yo*.5;else{let h=Math.max(s.near,Hd.distanceToPoint(js.origin));u=my(s,h,l.resolution)}Hd.expandByScalar(u),js.intersectsBox(Hd)!==!1&&(i?AC(this,t):CC(this,s,t))}onBeforeRender(e){let t=this.material.uniforms;t&&t.resolution&&(e.getViewport(Xm),this.material.uniforms.resolution.value.set(Xm.z,Xm.w))}};function Wd(n){let e=parseInt(n.slice(1),16);return[e>>16&255,e>>8&255,e&255]}var jc={viridis:["#440154","#482878","#3e4989","#31688e","#26828e","#1f9e89","#35b779","#6ece58","#b5de2b","#fde725"],slate:["#10161d","#2d3a46","#566775","#8d9aa3","#c4cac9","#f4f1e6"],ember:["#1d1147","#51127c","#8c2981","#c83e73","#f1605d","#fe9f6d","#fcd9a0"],balance:["#2166ac","#67a9cf","#d1e5f0","#f2f0ec","#fddbc7","#ef8a62","#b2182b"]};function Xd(n){return n==="intensity"?"slate":n==="incidence"?"ember":n==="distance"||n==="significance"?"balance":"viridis"}var ul=["#0072b2","#e69f00","#009e73","#cc79a7","#56b4e9","#d55e00","#b8a800","#7a5195","#8c8c8c"];function RC(n,e){let t=Math.min(1,Math.max(0,e))*(n.length-1),i=Math.min(n.length-2,Math.floor(t)),[s,r]=[Wd(n[i]),Wd(n[i+1])],o=t-i;return[s[0]+o*(r[0]-s[0]),s[1]+o*(r[1]-s[1]),s[2]+o*(r[2]-s[2])]}function gy(n){let e=new Uint8Array(1024);for(let t=0;t<256;t++)e.set([...RC(jc[n],t/255).map(Math.round),255],4*t);return e}function _y(n,e,t){if(e)return[.86,.13,.15];let i=t?[.56,.63,.7]:[.36,.43,.5],s=[.93,.58,.08],r=Math.min(1,Math.max(0,(Math.abs(n??0)-1.5)/1.5));return i.map((o,a)=>o+r*(s[a]-o))}function Zo(n,e){return[n[0][0]*e[0]+n[0][1]*e[1]+n[0][2]*e[2],n[1][0]*e[0]+n[1][1]*e[1]+n[1][2]*e[2],n[2][0]*e[0]+n[2][1]*e[1]+n[2][2]*e[2]]}function Zc(n,e){let t=[[0,0,0],[0,0,0],[0,0,0]];for(let i=0;i<3;i++)for(let s=0;s<3;s++)t[i][s]=n[i][0]*e[0][s]+n[i][1]*e[1][s]+n[i][2]*e[2][s];return t}function Jc(n){return[[n[0][0],n[1][0],n[2][0]],[n[0][1],n[1][1],n[2][1]],[n[0][2],n[1][2],n[2][2]]]}var jo=(n,e)=>[n[0]-e[0],n[1]-e[1],n[2]-e[2]],ri=n=>Math.hypot(n[0],n[1],n[2]),yy=(n,e)=>Zc(Zc(n,e),Jc(n));function Kc(n){let e=n.map(s=>[...s]),t=[[1,0,0],[0,1,0],[0,0,1]];for(let s=0;s<40;s++){let r=e[0][1]**2+e[0][2]**2+e[1][2]**2,o=e[0][0]**2+e[1][1]**2+e[2][2]**2;if(r<=1e-30*o||r===0)break;for(let[a,l]of[[0,1],[0,2],[1,2]]){if(e[a][l]===0)continue;let c=(e[l][l]-e[a][a])/(2*e[a][l]),u=(c>=0?1:-1)/(Math.abs(c)+Math.sqrt(c*c+1)),h=1/Math.sqrt(u*u+1),d=u*h;for(let f=0;f<3;f++){let[m,y]=[e[f][a],e[f][l]];e[f][a]=h*m-d*y,e[f][l]=d*m+h*y}for(let f=0;f<3;f++){let[m,y]=[e[a][f],e[l][f]];e[a][f]=h*m-d*y,e[l][f]=d*m+h*y}for(let f=0;f<3;f++){let[m,y]=[t[f][a],t[f][l]];t[f][a]=h*m-d*y,t[f][l]=d*m+h*y}}}let i=[0,1,2].sort((s,r)=>e[r][r]-e[s][s]);return{values:i.map(s=>e[s][s]),vectors:t.map(s=>i.map(r=>s[r]))}}function vy(n){return{turn:[n[0].slice(0,3),n[1].slice(0,3),n[2].slice(0,3)],shift:[n[0][3],n[1][3],n[2][3]]}}function xy(n,e,t,i){let s=vy(n),r=vy(e),o=Zc(r.turn,Jc(s.turn)),a=jo(i,s.shift),l=jo(Zo(o,a),a),c=jo(r.shift,s.shift);return{turn:Zc(Zc(t,o),Jc(t)),shift:Zo(t,[l[0]+c[0],l[1]+c[1],l[2]+c[2]])}}function by(n,e,t){let i=(s,r)=>s<r?n[r*(r+1)/2+s]:n[s*(s+1)/2+r];return[0,1,2].map(s=>[0,1,2].map(r=>i(3*e+s,3*e+r)+i(3*t+s,3*t+r)-i(3*e+s,3*t+r)-i(3*t+s,3*e+r)))}function PC(n){if(n<=0)return 0;let e=Math.sqrt(n/2);return Sy(e)-Math.sqrt(2*n/Math.PI)*Math.exp(-n/2)}function Sy(n){if(n<0)return-Sy(-n);if(n<2.5){let t=n,i=n;for(let s=1;s<200;s++){t*=-n*n/s;let r=t/(2*s+1);if(i+=r,Math.abs(r)<1e-17*Math.abs(i))break}return 2/Math.sqrt(Math.PI)*i}let e=0;for(let t=60;t>=1;t--)e=t/2/(n+e);return 1-Math.exp(-n*n)/(Math.sqrt(Math.PI)*(n+e))}function My(n){let e=0,t=200;for(let i=0;i<200;i++){let s=(e+t)/2;PC(s)<n?e=s:t=s}return Math.sqrt((e+t)/2)}function wy(n,e,t,i){let s=new Array(i).fill(0);for(let r=0;r<n.length;r++){let o=n[r];if(o===null||!Number.isFinite(o))continue;let a=Math.floor((o-e)/(t-e)*i);s[Math.min(i-1,Math.max(0,a))]+=1}return s}function Qc(n){if(!(n>0))return 1;let e=10**Math.floor(Math.log10(n)+1e-12),t=n/e+1e-9;return(t>=5?5:t>=2?2:1)*e}function Ey(n){let e=n.filter(Number.isFinite).sort((i,s)=>i-s);if(!e.length)return NaN;let t=e.length>>1;return e.length%2?e[t]:(e[t-1]+e[t])/2}var as={control:{colour:"#c8372d",symbol:"triangle",title:"control"},check:{colour:"#2b6cd4",symbol:"diamond",title:"check"},free:{colour:"#12876a",symbol:"circle",title:"free"},station:{colour:"#5a4fcf",symbol:"square",title:"station"}},jm=n=>as[n]??as.free;function wr(n,e){let t=new cl({linewidth:n,vertexColors:!0,transparent:!0,depthTest:!e,depthWrite:!1,opacity:e?.22:.95}),i=new Gd(new qo,t);return i.frustumCulled=!1,i.visible=!1,i}function Er(n,e,t){n.geometry.dispose(),n.geometry=new qo,e.length&&(n.geometry.setPositions(e),n.geometry.setColors(t)),n.userData.some=e.length>0}var Ty=[.91,.12,.55],hl={moved:{colour:"#d6246e",rgb:[.84,.14,.43]},"not moved":{colour:"#3d7f95",rgb:[.24,.5,.58]},"cannot tell":{colour:"#c98a12",rgb:[.79,.54,.07]}},qd=class{constructor(e){this.scene=e,this.visible=!0,this.lines=wr(3.5,!0),this.lines.material.opacity=1,this.cone=new Ec(.5,1,16).translate(0,-.5,0),this.paint=new Fo({depthTest:!1,transparent:!0}),this.heads=null,e.add(this.lines)}set(e,t,i){this.heads&&(this.scene.remove(this.heads),this.heads.dispose());let s=[],r=[],o=e.filter(c=>ri(c.moved)>0),a=new Qa(this.cone,this.paint,o.length);a.frustumCulled=!1;let l=new B(0,1,0);o.forEach((c,u)=>{let h=new B(...i.toDrawing(c.from)),d=new B(...i.toAxes(c.moved)).multiplyScalar(t),f=h.clone().add(d),m=d.length();s.push(...h.toArray(),...f.clone().addScaledVector(d,-.3).toArray()),r.push(...c.colour,...c.colour),a.setMatrixAt(u,new ht().compose(f,new rs().setFromUnitVectors(l,d.clone().normalize()),new B(m*.28,m*.36,m*.28))),a.setColorAt(u,new lt(...c.colour))}),a.renderOrder=5,Er(this.lines,s,r),this.heads=a,this.scene.add(a),this.show(this.visible)}show(e){this.visible=e,this.lines.visible=e&&!!this.lines.userData.some,this.heads&&(this.heads.visible=e)}},dl=class{constructor(e,t,i){this.toDrawing=e,this.frame=t,this.factor=i,this.scene=new $s,this.front=new $s;let s=new Lc(16777215,9080729,2);s.position.set(0,0,1);let r=new Dc(16777215,1.6);r.position.set(-.5,-.8,1.2),this.scene.add(s,r),this.rayLines=wr(1.25,!1),this.rayLines.material.opacity=.6,this.rayGhosts=wr(1.1,!0),this.rayGhosts.material.opacity=.14,this.badRays=wr(2.6,!0),this.badRays.material.opacity=.95,this.edgeLines=wr(3.5,!1),this.edgeGhosts=wr(3,!0),this.marked=wr(4,!0),this.marked.material.opacity=1,this.planeLines=wr(1.5,!1),this.box=wr(1.5,!0),this.box.material.opacity=.9,this.scene.add(this.rayLines,this.edgeLines,this.planeLines),this.front.add(this.rayGhosts,this.badRays,this.edgeGhosts,this.box,this.marked),this.moves=new qd(this.front),this.epochs=new qd(this.front),this.epochBalls=null,this.ellipsoids=null,this.planes=new ss,this.planes.visible=!1,this.scene.add(this.planes),this.rays=[],this.edges=[]}get materials(){return[this.rayLines,this.rayGhosts,this.badRays,this.edgeLines,this.edgeGhosts,this.marked,this.planeLines,this.box,this.moves.lines,this.epochs.lines].map(e=>e.material)}size(e,t){for(let i of this.materials)i.resolution.set(e,t)}static exaggeration(e,t){let i=e.filter(r=>r.covariance).map(r=>Math.sqrt(Math.max(0,Kc(r.covariance).values[0]))),s=Ey(i.filter(r=>r>0));return s>0?Math.max(1,Qc(.03*t/s)):1}setEllipsoids(e,t){this.#t(this.ellipsoids);let i=e.filter(s=>s.covariance&&s.xyz);this.ellipsoids=this.#e(i,t,.82),this.ellipsoids.visible=this.ellipsoidsVisible??!0,this.ellipsoidCount=i.length,this.scene.add(this.ellipsoids)}#t(e){e&&(this.scene.remove(e),e.dispose())}#e(e,t,i){let s=this.skins??=new Map;s.has(i)||s.set(i,new Rc({transparent:!0,opacity:i}));let r=new Qa(this.ball??=new Ac(1,32,20),s.get(i),e.length);r.frustumCulled=!1;let o=new ht;return e.forEach((a,l)=>{let{values:c,vectors:u}=Kc(yy(this.frame,a.covariance)),h=c.map(f=>Math.sqrt(Math.max(f,1e-16))*this.factor*t),d=this.toDrawing(a.xyz);if(o.set(u[0][0]*h[0],u[0][1]*h[1],u[0][2]*h[2],d[0],u[1][0]*h[0],u[1][1]*h[1],u[1][2]*h[2],d[1],u[2][0]*h[0],u[2][1]*h[1],u[2][2]*h[2],d[2],0,0,0,1),o.determinant()<0){let f=o.elements;f[8]*=-1,f[9]*=-1,f[10]*=-1}r.setMatrixAt(l,o),r.setColorAt(l,new lt(a.hex??jm(a.role).colour))}),r}setRays(e,t){this.rays=e.map(a=>({...a,a:this.toDrawing(a.from),b:this.toDrawing(a.to)}));let[i,s,r,o]=[[],[],[],[]];for(let a of this.rays){if(a.off)continue;let l=_y(a.w,a.suspicious,t);(a.suspicious?r:i).push(...a.a,...a.b),(a.suspicious?o:s).push(...l,...l)}Er(this.rayLines,i,s),Er(this.rayGhosts,i,s),Er(this.badRays,r,o),this.rayCount=(i.length+r.length)/6}setEdges(e){let t=[],i=[];this.edges=e.map(s=>({...s,a:this.toDrawing(s.from),b:this.toDrawing(s.to)}));for(let s of this.edges){let r=s.outlying?[.86,.13,.15]:[.36,.31,.81];t.push(...s.a,...s.b),i.push(...r,...r)}Er(this.edgeLines,t,i),Er(this.edgeGhosts,t,i)}setPlanes(e){this.planes.clear();let t=[],i=[];for(let s of e){let r=new B(...this.toAxes(s.normal)).normalize(),a=(Math.abs(r.z)>.99?new B(0,1,0):new B(0,0,1)).clone().cross(r).normalize(),l=r.clone().cross(a),[c,u]=[s.extent||1,s.extent||1];s.axes&&s.half&&([a,l]=s.axes.map(m=>new B(...this.toAxes(m))),[c,u]=s.half);let h=new B(...this.toDrawing(s.centre)),d=[[-c,-u],[c,-u],[c,u],[-c,u]].map(([m,y])=>h.clone().addScaledVector(a,m).addScaledVector(l,y));for(let m=0;m<4;m++)t.push(...d[m].toArray(),...d[(m+1)%4].toArray()),i.push(.1,.55,.62,.1,.55,.62);let f=new Bn().setFromPoints([d[0],d[1],d[2],d[0],d[2],d[3]]);this.planes.add(new Zn(f,this.glass??=new Fo({color:1739934,transparent:!0,opacity:.22,side:os,depthWrite:!1})))}Er(this.planeLines,t,i)}toAxes(e){return this.frame.map(t=>t[0]*e[0]+t[1]*e[1]+t[2]*e[2])}setMoves(e,t,i){let s=e.filter(r=>ri(r.moved)>i).map(r=>({...r,colour:Ty}));this.moves.set(s,t,this),this.moveCount=s.length}setEpochs(e,t){this.epochs.set(e.map(s=>({...s,colour:hl[s.verdict]?.rgb??Ty})),t,this),this.epochCount=e.length,this.#t(this.epochBalls);let i=e.map(s=>({...s,xyz:s.from.map((r,o)=>r+t*s.moved[o]),hex:hl[s.verdict]?.colour}));this.epochBalls=this.#e(i,t,.4),this.epochBalls.visible=this.epochs.visible,this.scene.add(this.epochBalls)}mark(e,t=[1,.76,.03]){let i=[],s=[];for(let[r,o]of e??[])i.push(...r,...o),s.push(...t,...t);Er(this.marked,i,s),this.marked.visible=i.length>0}setBox(e){let t=[],i=[];if(e){let[s,r]=[Math.cos(e.turn),Math.sin(e.turn)],o=(l,c,u)=>{let[h,d,f]=[l*e.half[0],c*e.half[1],u*e.half[2]];return[e.centre[0]+s*h-r*d,e.centre[1]+r*h+s*d,e.centre[2]+f]},a=[];for(let l of[-1,1])for(let c of[-1,1])a.push([o(l,c,-1),o(l,c,1)],[o(l,-1,c),o(l,1,c)],[o(-1,l,c),o(1,l,c)]);for(let[l,c]of a)t.push(...l,...c),i.push(.95,.55,.05,.95,.55,.05)}Er(this.box,t,i),this.box.visible=!!e}show(e){this.ellipsoidsVisible=e("ellipsoids"),this.ellipsoids&&(this.ellipsoids.visible=this.ellipsoidsVisible),this.rayLines.visible=this.rayGhosts.visible=e("rays")&&!!this.rayLines.userData.some,this.badRays.visible=e("rays")&&!!this.badRays.userData.some,this.edgeLines.visible=this.edgeGhosts.visible=e("edges")&&!!this.edgeLines.userData.some,this.planes.visible=e("planes"),this.planeLines.visible=e("planes")&&!!this.planeLines.userData.some,this.moves.show(e("moves")),this.epochs.show(e("epochs")),this.epochBalls&&(this.epochBalls.visible=e("epochs"))}};function Ay(n,e,t){let[i,s]=[t[0]-e[0],t[1]-e[1]],r=Math.min(1,Math.max(0,((n[0]-e[0])*i+(n[1]-e[1])*s)/(i*i+s*s||1)));return{distance:Math.hypot(e[0]+r*i-n[0],e[1]+r*s-n[1]),t:r}}var Jo=class extends Error{constructor(e,t){super(t?.sentence??t?.detail??(Array.isArray(t?.defect)?t.defect.join(" "):"")??`the program answers ${e}`),this.status=e,this.body=t}},eu=class extends Error{constructor(){super("The program that gave this page does not answer.")}},Zm=()=>{};function Cy(n){Zm=n}async function Jm(n,e){try{let t=await fetch(n,e);return Zm(!0),t}catch(t){throw t?.name==="AbortError"?t:(Zm(!1),new eu)}}async function Ry(n){let e=null;try{e=await n.json()}catch{}if(!n.ok)throw new Jo(n.status,e);return e}async function ls(n,e={},t=void 0){let i=new URL(n,document.baseURI);for(let[s,r]of Object.entries(e))i.searchParams.set(s,String(r));return Ry(await Jm(i,{headers:{Accept:"application/json"},signal:t}))}async function Py(n){let e=await Jm(new URL(n,document.baseURI),{});if(!e.ok)throw new Jo(e.status,null);return new Float64Array(await e.arrayBuffer())}async function Yd(n,e){return Ry(await Jm(new URL(n,document.baseURI),{method:"POST",headers:{"Content-Type":"application/json",Accept:"application/json"},body:JSON.stringify(e)}))}function Iy(n,e){let t=new EventSource(new URL("api/events",document.baseURI));for(let[i,s]of Object.entries(n))t.addEventListener(i,r=>{let o=null;try{o=JSON.parse(r.data)}catch{return}s(o)});return t.onopen=()=>e(!0),t.onerror=()=>e(!1),t}var Ue=je(null),wt=je(null),oi=je(null),ro=je(null),Ar=je(null),Js=je(null),Cr=je(null),Jd=je(!1),pl=je(!0),Qo=je(!1),Ko=je([]),Km=je(!1),Ks=je(!1),ea=je({}),nu=je(!0),Fi=je("light"),Kn=je("sigma_z"),ml=je(!1),Zs=je({}),ao=je(2),gl=je(!0),ta=je(.5),_l=je(2e6),Rr=je(0),Pr=je(0),Tr=je(new Set(["edges","planes","rejected","comparisons"])),Jn=je(null),tu=je(null),Kd=je(!1),pi=je("observations"),In=je({...tc}),oo=je({by:"w",down:!0}),Vt=je(null),Pi=je("select"),Qs=je([]),Cs=je(null),lo=je({points:0,total:0,loading:0}),Ii=je(new Set),Li=je(null),Ir=je(!0),co=je(!0),Uy=[["points","Points"],["stations","Stations"],["names","Names"],["ellipsoids","Ellipsoids"],["rays","Observations"],["edges","Registration"],["planes","Planes"],["moves","Moves"],["epochs","Displacements"],["rejected","Rejected targets"],["comparisons","Comparisons"]],en=n=>!Tr.value.has(n);function iu(n,e){let t=new Set(Tr.value);e?t.delete(n):t.add(n),Tr.value=t}var Qd=$t(()=>[...(Ue.value?.targets?.scan??[]).keys()].filter(n=>Ue.value.targets.accepted?.[n]===!1)),uo=$t(()=>oi.value?.edits??wt.value?.edits??Ue.value?.edits??[]),yn=$t(()=>{let n=Ue.value;if(!n)return[];let e=new Map((oi.value?.points??[]).map(i=>[i.name,i])),t=IC.value;return n.points.name.map((i,s)=>{let r=e.get(i);return{name:i,role:t.get(i)??n.points.role[s],xyz:r?.xyz??n.points.xyz[s],covariance:r?.covariance??n.points.covariance[s],before:r?.before??(oi.value?null:n.points.covariance[s]),moved:r?.moved??null,words:Object.entries(n.points.frames??{}).map(([o,a])=>[o,a[s]])}})}),IC=$t(()=>{let n=new Map;for(let e of uo.value)e.role&&n.set(e.point,e.role);for(let e of oi.value?.points??[])e.role&&n.set(e.name,e.role);return n}),Di=$t(()=>{let n=Ue.value;if(!n)return[];let e=new Map((oi.value?.stations??[]).map(t=>[t.name,t]));return n.stations.name.map((t,i)=>{let s=e.get(t),r=s?.world_from_scanner??n.stations.pose[i];return{name:t,role:"station",kind:n.stations.kind[i],pose:r,posed:n.stations.pose_of_clouds?.[i]??n.stations.pose[i],xyz:s?.world_from_scanner?r.slice(0,3).map(o=>o[3]):n.stations.xyz[i],full:s?.covariance??n.stations.covariance[i],covariance:Ly(s?.covariance??n.stations.covariance[i]),before:Ly(s?.before??(oi.value?null:n.stations.covariance[i])),moved:s?.moved??null,turned:s?.turned??null,clouds:n.stations.clouds?.[i]??[]}})}),Ly=n=>n?n.slice(0,3).map(e=>e.slice(0,3)):null,Lt=$t(()=>{let n=Ue.value;if(!n)return{id:[]};let e=n.observations,t=ro.value?.columns,i={...e};if(t){for(let[o,a]of Object.entries(t))Array.isArray(a)&&a.length===e.id.length&&(i[o]=a);let r=t.words&&typeof t.words=="object"?t.words:{};i.words={value:e.words?.value,sigma:e.words?.sigma,...r}}let s=new Map(uo.value.filter(r=>r.observation).map(r=>[r.observation,r]));return Ks.value&&s.size&&(i.state=e.id.map((r,o)=>s.get(r)?.use??i.state[o]),i.reason=e.id.map((r,o)=>s.get(r)?.reason??i.reason?.[o]??"")),i}),vl=$t(()=>{let n=Ue.value;return n?{...n.summary,...oi.value?.sigma0??{},...oi.value?.sigma0?{verdict:oi.value.sigma0.verdict??null}:{}}:null}),ho=$t(()=>ro.value?.warnings??Ue.value?.warnings??[]),Oy=$t(()=>Ap(Lt.value.kind??[])),Fy=$t(()=>Ap([...Lt.value.from??[]])),ji=5e-6,Qm=$t(()=>wt.value?.ran===!1?"since the project was opened":"against the last run"),su=$t(()=>oi.value?[...yn.value,...Di.value.filter(n=>n.kind==="scanner")].filter(n=>n.moved&&n.moved.every(e=>e!==null)).map(n=>({...n,long:ri(n.moved)})).sort((n,e)=>e.long-n.long):[]),na=$t(()=>{let n=Ar.value;return n?[...n.points,...n.stations].filter(e=>e.moved&&e.moved.every(t=>t!==null)).map(e=>({name:e.name,moved:e.moved,xyz:e.xyz??e.world_from_scanner.slice(0,3).map(t=>t[3]),long:ri(e.moved)})).sort((e,t)=>t.long-e.long):su.value});function ia(n){let e=wt.value;if(n==="run")return e?.ran===!1?"project as opened":"last run";let t=e?.decisions?.[n],i=t===void 0?"":t===0?", no edits":t===1?", 1 edit":`, ${t} edits`;return`state ${n}${i}${n===String(e?.revision)?" (now)":""}`}var yl=$t(()=>{let n=na.value[0]?.long??0,e=ru.value;return n>ji?Math.max(1,Qc(.24*e/n)):1}),ru=je(50),ef=je(0),Rs=$t(()=>{let n=Ue.value?.epochs??[],e=n[Math.min(ef.value,n.length-1)];return e?e.name.map((t,i)=>({name:t,from:e.xyz[i],moved:e.moved[i],covariance:e.covariance[i],verdict:e.verdict[i],test:e.test[i],limit:e.limit[i],reference:e.reference[i],detectable:e.detectable[i],long:ri(e.moved[i])})).sort((t,i)=>i.long-t.long):[]}),tf=$t(()=>{let n=Rs.value[0]?.long??0;return n>0?Math.max(1,Qc(.2*ru.value/n)):1}),xl=$t(()=>dl.exaggeration(yn.value,ru.value)),nf=$t(()=>{let n=Ue.value;if(!n?.rays)return[];let e=Lt.value,t=new Map([...Di.value,...yn.value].filter(s=>s.xyz).map(s=>[s.name,s.xyz])),i=[];return n.rays.rows.forEach((s,r)=>{let[o,a]=[t.get(n.rays.from[r]),t.get(n.rays.to[r])];if(!o||!a)return;let l=null,c=!1,u=!0;for(let h of s)e.state[h]!=="off"&&(u=!1,e.w[h]!==null&&(l===null||Math.abs(e.w[h])>Math.abs(l))&&(l=e.w[h]),c||=!!e.suspicious[h]);i.push({k:r,names:[n.rays.from[r],n.rays.to[r]],from:o,to:a,w:l,suspicious:c,off:u,rows:s})}),i}),Lr=$t(()=>{let n=new Map;for(let e of Ue.value?.clouds??[])for(let[t,i]of Object.entries(e.attributes??{})){if(t==="rgb"){i&&n.set("rgb",{title:"RGB"});continue}if(!i||typeof i!="object")continue;let s=n.get(t),r=e.points??1;s?s.all.push([r,i.low,i.high]):n.set(t,{...i,all:[[r,i.low,i.high]]})}for(let e of n.values()){if(!e.all)continue;let t=Math.max(...e.all.map(([s])=>s)),i=e.all.filter(([s])=>s>.05*t);e.low=Math.min(...i.map(([,s])=>s)),e.high=Math.max(...i.map(([,,s])=>s))}return n}),sa=$t(()=>{let n=Zs.value[Kn.value];if(n)return n;let e=Lr.value.get(Kn.value);return e?.low!==void 0?[e.low,e.high>e.low?e.high:e.low+1e-9]:[0,1]}),LC=0;function cs(n,e="info"){if(Ko.value.some(i=>i.words===n))return;let t=++LC;Ko.value=[...Ko.value.slice(-3),{id:t,words:n,kind:e}],e==="info"&&setTimeout(()=>eg(t),6e3)}function eg(n){Ko.value=Ko.value.filter(e=>e.id!==n)}var By=[[1,0,0],[0,1,0],[0,0,1]],Dy=n=>Zo(Jc(Ue.value.frame??By),n).map((e,t)=>e+Ue.value.origin[t]),Ny=n=>Zo(Ue.value.frame??By,jo(n,Ue.value.origin));function ou(){let n=Vt.value;return u_({camera:tu.value?{...tu.value,eye:Dy(tu.value.eye)}:void 0,colour:ml.value||Lr.value.size?Kn.value:void 0,range:Zs.value[Kn.value]??null,hidden:[...Tr.value].sort(),size:ao.value,edl:ta.value,ellipsoids:Rr.value||void 0,moves:Pr.value||void 0,slice:Jn.value?{...Jn.value,centre:Dy(Jn.value.centre)}:null,tab:pi.value,sort:oo.value.by,down:oo.value.down,text:In.value.text,station:In.value.station,kind:In.value.kind,state:In.value.state,theme:Fi.value,select:n?.type==="row"?`row:${n.id}`:n?.name?`${n.type}:${n.name}`:""})}function sf(n,e){let t=h_(n);ys(()=>{if(t.colour&&(Kn.value=t.colour,ml.value=!0),t.range&&t.colour&&(Zs.value={...Zs.value,[t.colour]:t.range}),t.hidden?Tr.value=new Set(t.hidden):n.length>1&&t.camera&&(Tr.value=new Set),t.size&&(ao.value=Math.min(12,Math.max(1,t.size))),t.edl!==void 0&&(ta.value=Math.min(2,t.edl)),Rr.value=t.ellipsoids??0,Pr.value=t.moves??0,Jn.value=t.slice?{...t.slice,centre:Ny(t.slice.centre)}:null,t.tab&&(pi.value=t.tab),t.sort&&(oo.value={by:t.sort,down:t.down??!0}),In.value={...In.value,text:t.text??"",station:t.station??"",kind:t.kind??"",state:t.state??""},(t.theme==="dark"||t.theme==="light")&&(Fi.value=t.theme),t.select){let i=t.select.indexOf(":"),[s,r]=[t.select.slice(0,i),t.select.slice(i+1)];s==="row"?DC(r):["point","station","target"].includes(s)&&(Vt.value={type:s,name:r})}}),t.camera&&e.camera({...t.camera,eye:Ny(t.camera.eye)})}function DC(n){let e=Lt.value.id.indexOf(n);e<0||(Vt.value={type:"row",id:n,row:e},Ii.value=new Set([n]))}var Zd={names:null,decided:null};async function tg(){let n=await ls("scene.json");Ue.value=n}function fl(n){if(!n||oi.value&&n.revision<oi.value.revision)return;ys(()=>{oi.value=n,Js.value=null,Ks.value=!ro.value||ro.value.revision!==n.revision});let e=n.points.map(i=>i.name).join(`
`),t=JSON.stringify((n.edits??[]).filter(i=>i.do==="target"));Ue.value&&(e!==Zd.names||t!==Zd.decided)&&(Zd.names!==null&&tg(),Zd={names:e,decided:t})}async function so(){try{wt.value=await ls("api/session")}catch(n){if(n instanceof Jo&&n.status===404)wt.value=null;else throw n}}async function er(n,e={}){if(Qo.value)return null;Jd.value=!0;let t=performance.now();try{let i=await Yd(n,{revision:wt.value?.revision??0,...e});return i?.points?fl(i):i?.adjusted?.points&&fl(i.adjusted),await so(),ng.value=performance.now()-t,i}catch(i){return i instanceof Jo?i.status===409?(await so(),cs("The network was changed elsewhere meanwhile. It is shown as it is now; please say your change again.","error")):Array.isArray(i.body?.defect)?(Js.value=i.body.defect,await so()):cs(i.message,"error"):i instanceof eu||cs(String(i?.message??i),"error"),null}finally{Jd.value=!1}}var ng=je(0);var NC=648e3/Math.PI,UC=2e5/Math.PI,au="–",OC=" ",lu=n=>typeof n=="number"&&Number.isFinite(n);function Gt(n){return String(Math.round(n)).replace(/\B(?=(\d{3})+(?!\d))/g,OC)}var ai=(n,e=4)=>lu(n)?n.toFixed(e):au,xt=(n,e=2)=>lu(n)?ig((n*1e3).toFixed(e)):au,Ft=(n,e=2)=>lu(n)?ig(n.toFixed(e)):au,ig=n=>/^-0\.?0*$/.test(n)?n.slice(1):n.replace("-","−");function sg(n,e){return n==="m"?{unit:"mm",factor:1e3,digits:2}:n==="rad"?e==="gon"?{unit:"mgon",factor:UC,digits:2}:{unit:"″",factor:NC,digits:1}:n==="m2"?{unit:"mm²",factor:1e6,digits:2}:{unit:n&&n!=="1"?n:"",factor:1,digits:5}}function Zi(n,e,t){if(!lu(n))return au;let i=sg(e,t),s=Ft(n*i.factor,i.digits);return i.unit?`${s}${i.unit==="″"?"":" "}${i.unit}`:s}var rf=n=>lu(n)?`${(n*180/Math.PI).toFixed(1)}°`:au;function ky(n,e){let t=Math.max(0,Math.min(6,-Math.floor(Math.log10(Math.abs(e)||1)+1e-9)));return ig(n.toFixed(t))}function zy(n,e,t=5){let i=e-n;if(!(i>0)||!Number.isFinite(i))return{step:1,ticks:[n]};let s=i/t,r=10**Math.floor(Math.log10(s)),o=s/r,a=(o>5?10:o>2?5:o>1?2:1)*r,l=[];for(let c=Math.ceil(n/a-1e-9);c*a<=e+1e-9*i;c++)l.push(c*a);return{step:a,ticks:l}}var Bi=n=>String(n??"").replaceAll("_"," ");var Vy=45,fo=Math.tan(Vy*Math.PI/360),cu={plan:{title:"Plan",yaw:0,pitch:-Math.PI/2},south:{title:"From the south",yaw:0,pitch:0},east:{title:"From the east",yaw:-Math.PI/2,pitch:0},north:{title:"From the north",yaw:Math.PI,pitch:0},west:{title:"From the west",yaw:Math.PI/2,pitch:0}},of=class{constructor(e){this.moved=e,this.perspective=new Ei(Vy,1,.1,1e3),this.parallel=new zo(-1,1,1,-1,-1e3,1e3);for(let t of[this.perspective,this.parallel])t.matrixAutoUpdate=!1;this.ortho=!1,this.at=new B(0,-50,30),this.yaw=0,this.pitch=-.5,this.tall=50,this.pivot=new B,this.ball=new Pn(new B,50),this.width=1,this.height=1}get camera(){return this.ortho?this.parallel:this.perspective}axes(e=this.yaw,t=this.pitch){let[i,s]=[Math.sin(e),Math.cos(e)],r=new B(s,-i,0),o=new B(i*Math.cos(t),s*Math.cos(t),Math.sin(t));return{right:r,ahead:o,up:r.clone().cross(o)}}#t(e=this.yaw,t=this.pitch){let{right:i,up:s,ahead:r}=this.axes(e,t);return new ht().makeBasis(i,s,r.negate())}apply(){let e=this.width/this.height,t=this.#t().setPosition(this.at),{ahead:i}=this.axes(),s=this.ball.center.clone().sub(this.at).dot(i),r=Math.max(10,s+this.ball.radius*1.2);if(this.ortho){let a=this.tall/2;Object.assign(this.parallel,{left:-a*e,right:a*e,top:a,bottom:-a}),this.parallel.near=s-this.ball.radius*1.2-10,this.parallel.far=s+this.ball.radius*1.2+10}else this.perspective.aspect=e,this.perspective.far=r,this.perspective.near=Math.max(r*2e-4,Math.min(.5,r*.001),s-this.ball.radius*1.2);let o=this.camera;o.matrix.copy(t),o.matrixWorld.copy(t),o.matrixWorldInverse.copy(t).invert(),o.updateProjectionMatrix(),o.updateMatrixWorld(!0)}#e(){this.apply(),this.moved()}size(e,t){this.width=Math.max(1,e),this.height=Math.max(1,t),this.#e()}fit(e,t=1.02){if(e.isEmpty())return;let i=e.getCenter(new B),{right:s,up:r,ahead:o}=this.axes(),a=this.width/this.height,l=[];for(let h of[e.min.x,e.max.x])for(let d of[e.min.y,e.max.y])for(let f of[e.min.z,e.max.z])l.push(new B(h,d,f).sub(i));let c=1,u=1;for(let h of l){let[d,f,m]=[h.dot(s),h.dot(r),h.dot(o)];c=Math.max(c,Math.abs(f)/fo-m,Math.abs(d)/fo/a-m),u=Math.max(u,2*Math.abs(f),2*Math.abs(d)/a)}this.pivot.copy(i),this.tall=this.ortho?u*1.06:c*2*fo,this.at.copy(i).addScaledVector(o,this.ortho?-this.ball.radius:-c*t),this.#e()}look(e,t){let i=cu[e];i&&(this.ortho=!0,this.yaw=i.yaw,this.pitch=i.pitch,this.fit(t))}project(e){if(e===this.ortho)return;let{ahead:t}=this.axes();if(e){let i=Math.max(.5,this.pivot.clone().sub(this.at).dot(t));this.tall=2*i*fo}else{let i=this.pivot.clone().sub(this.at).dot(t);this.at.addScaledVector(t,i-this.tall/(2*fo))}this.ortho=e,this.#e()}orbit(e,t,i){let s=e.clone().sub(this.at).applyMatrix4(this.#t().invert());this.yaw+=t,this.pitch=Math.min(Math.PI/2,Math.max(-Math.PI/2,this.pitch+i)),this.at.copy(e).sub(s.applyMatrix4(this.#t())),this.pivot.copy(e),this.#e()}metresOfPixel(e){return this.ortho?this.tall/this.height:2*Math.max(.05,e.clone().sub(this.at).dot(this.axes().ahead))*fo/this.height}pan(e,t,i){let s=this.metresOfPixel(e),{right:r,up:o}=this.axes();this.at.addScaledVector(r,-t*s).addScaledVector(o,i*s),this.pivot.copy(e).addScaledVector(r,-t*s).addScaledVector(o,i*s),this.#e()}zoom(e,t){if(this.ortho){let{right:i,up:s}=this.axes(),r=e.clone().sub(this.at),o=1-t;this.at.addScaledVector(i,r.dot(i)*o).addScaledVector(s,r.dot(s)*o),this.tall=Math.min(1e5,Math.max(.01,this.tall*t))}else{let i=this.at.clone().sub(e),s=i.length(),r=Math.min(this.ball.radius*20,Math.max(.15,s*t));s>1e-9&&this.at.copy(e).addScaledVector(i,r/s),this.pivot.copy(e)}this.#e()}visit(e,t){let{ahead:i}=this.axes();if(this.ortho){let{right:s,up:r}=this.axes(),o=e.clone().sub(this.at);this.at.addScaledVector(s,o.dot(s)).addScaledVector(r,o.dot(r)),this.tall=Math.min(this.tall,t*2)}else{let s=Math.min(t,Math.max(1,e.distanceTo(this.at)));this.at.copy(e).addScaledVector(i,-s)}this.pivot.copy(e),this.#e()}under(e,t){let i=this.camera,s=this.pivot.clone().project(i).z,r=Math.min(.9999,Math.max(-.9999,s));return new B(e/this.width*2-1,1-t/this.height*2,r).unproject(i)}between(e,t){let i=new B(...t).sub(new B(...e));this.ortho=!1,this.yaw=Math.atan2(i.x,i.y),this.pitch=Math.atan2(i.z,Math.hypot(i.x,i.y)),this.at.fromArray(e),this.pivot.fromArray(t),this.tall=2*i.length()*fo,this.#e()}state(){return{eye:this.at.toArray(),yaw:this.yaw,pitch:this.pitch,ortho:this.ortho,height:this.tall}}restore(e){this.at.fromArray(e.eye),this.yaw=e.yaw,this.pitch=Math.min(Math.PI/2,Math.max(-Math.PI/2,e.pitch)),this.ortho=e.ortho,this.tall=e.height;let{ahead:t}=this.axes();this.pivot.copy(this.at).addScaledVector(t,e.ortho?this.ball.radius:e.height/(2*fo)),this.#e()}};function Hy(n,e,t){let i=new Map,s=null,r=null,o=0,a=null,l=0,c=h=>{let d=n.getBoundingClientRect();return[h.clientX-d.left,h.clientY-d.top]};n.addEventListener("pointerdown",h=>{let[d,f]=c(h);try{n.setPointerCapture(h.pointerId)}catch{}i.set(h.pointerId,[d,f]),i.size===1&&(o=0,s=null,r=h.button===0?t.grab(d,f):null)}),n.addEventListener("pointermove",h=>{let[d,f]=c(h),m=i.get(h.pointerId);if(!m){t.hover(d,f);return}let[y,g]=[d-m[0],f-m[1]];if(i.size===2){let p=[...i.entries()].find(([b])=>b!==h.pointerId)?.[1];s??=t.hit((d+p[0])/2,(f+p[1])/2)??e.under((d+p[0])/2,(f+p[1])/2);let[x,T]=[Math.hypot(m[0]-p[0],m[1]-p[1]),Math.hypot(d-p[0],f-p[1])];x>5&&T>5&&e.zoom(s,x/T),e.pan(s,y/2,g/2),o=99}else o+=Math.hypot(y,g),o>3&&(r?r(y,g):(s??=t.hit(...m)??e.under(...m),h.shiftKey||h.buttons!==1||e.ortho&&!h.ctrlKey?e.pan(s,y,g):e.orbit(s,y/e.width*3.2,-g/e.height*2.2)));i.set(h.pointerId,[d,f])});let u=h=>{if(!i.delete(h.pointerId))return;let[d,f]=c(h);h.type==="pointerup"&&h.button===0&&o<=3&&i.size===0&&t.click(d,f,h),s=null,i.size||(r=null)};n.addEventListener("pointerup",u),n.addEventListener("pointercancel",u),n.addEventListener("contextmenu",h=>h.preventDefault()),n.addEventListener("dblclick",h=>t.visit(...c(h))),n.addEventListener("wheel",h=>{h.preventDefault();let[d,f]=c(h),m=performance.now();m-l>350&&(a=t.hit(d,f)??e.under(d,f)),l=m;let y=h.deltaMode===1?h.deltaY*30:h.deltaY;e.zoom(a,Math.exp(Math.max(-300,Math.min(300,y))*.0015))},{passive:!1}),n.addEventListener("keydown",h=>{if(h.ctrlKey||h.metaKey||h.altKey)return;let d=40,m={ArrowLeft:[1,0],ArrowRight:[-1,0],ArrowUp:[0,1],ArrowDown:[0,-1]}[h.key];if(m)h.shiftKey||e.ortho?e.pan(e.pivot.clone(),m[0]*d,m[1]*d):e.orbit(e.pivot.clone(),m[0]*.08,-m[1]*.06);else if(h.key==="+"||h.key==="=")e.zoom(e.pivot.clone(),.85);else if(h.key==="-")e.zoom(e.pivot.clone(),1/.85);else return;h.preventDefault()})}var Tf=SM(Hx(),1);var gg=class{constructor(){this.list=[]}push(e,t){let i=this.list;i.push({weight:t,item:e});let s=i.length-1;for(;s>0;){let r=s-1>>1;if(i[r].weight>=i[s].weight)break;[i[r],i[s]]=[i[s],i[r]],s=r}}pop(){let e=this.list,t=e[0],i=e.pop();if(e.length&&i){e[0]=i;for(let s=0;;){let[r,o]=[2*s+1,2*s+2],a=s;if(r<e.length&&e[r].weight>e[a].weight&&(a=r),o<e.length&&e[o].weight>e[a].weight&&(a=o),a===s)break;[e[a],e[s]]=[e[s],e[a]],s=a}}return t?.item}get size(){return this.list.length}};function $x(n,e){let t=new gg;for(let o of n)e.pixels(o)>0&&t.push(o,1/0);let i=[],s=[],r=0;for(;t.size;){let o=t.pop();if(o.page){s.push(o);continue}if(!(r+o.count>e.budget&&(o.level>0||i.length))){o.count>0&&(i.push(o),r+=o.count);for(let a of o.children??[]){let l=e.pixels(a);l<=0||o.spacing*l<e.finest||t.push(a,l*a.radius)}}}return{nodes:i,points:r,pages:s}}function _g(n,e){let t=[];for(let[i,s]of[[e.nodes,!1],[e.pages,!0]])for(let[r,o]of Object.entries(i)){let[a,l,c,u]=r.split("-").map(Number),h=n.cube.edge/2**a,d=n.nodes.get(r),f=d??{key:r,cloud:n,level:a,count:0,spacing:n.spacing/2**a,centre:[n.cube.least[0]+(l+.5)*h,n.cube.least[1]+(c+.5)*h,n.cube.least[2]+(u+.5)*h],half:h/2,radius:h/2*Math.sqrt(3),children:null,page:null,offset:0,length:0,points:null,state:"none",used:0};s?f.page=o:(f.page=null,f.count=o.pointCount,f.offset=o.pointDataOffset,f.length=o.pointDataLength),d||(n.nodes.set(r,f),t.push({node:f,level:a,x:l,y:c,z:u}))}t.sort((i,s)=>i.level-s.level);for(let{node:i,level:s,x:r,y:o,z:a}of t){if(s===0)continue;let l=n.nodes.get(`${s-1}-${r>>1}-${o>>1}-${a>>1}`);l&&(l.children??=[]).push(i)}}var C2={int8:(n,e)=>n.getInt8(e),uint8:(n,e)=>n.getUint8(e),int16:(n,e)=>n.getInt16(e,!0),uint16:(n,e)=>n.getUint16(e,!0),int32:(n,e)=>n.getInt32(e,!0),uint32:(n,e)=>n.getUint32(e,!0),float32:(n,e)=>n.getFloat32(e,!0),float64:(n,e)=>n.getFloat64(e,!0)},R2={6:30,7:36,8:38};function Gx(n,e){let t=n.pointDataRecordFormat,i=R2[t];if(i===void 0)throw new Error(`point format ${t} is not one of COPC (6, 7, 8)`);let s=[];for(let r of e){let a=`${{signed:"int",unsigned:"uint",float:"float"}[r.type??""]}${r.length*8}`;C2[a]&&s.push({name:r.name,at:i,type:a,scale:r.scale??1,offset:r.offset??0}),i+=r.length}return{format:t,recordLength:n.pointDataRecordLength,scale:[...n.scale],offset:[...n.offset],extra:s}}var Ef=class{constructor(e){this.url=e,this.blob=null,this.fetching=null}async get(e,t){if(this.fetching&&await this.fetching,this.blob)return new Uint8Array(await this.blob.slice(e,t).arrayBuffer());let i=await fetch(this.url,{headers:{Range:`bytes=${e}-${t-1}`}}).catch(r=>{throw Object.assign(r,{silent:!0})});if(i.status===206)return new Uint8Array(await i.arrayBuffer());if(!i.ok)throw new Error(`${this.url}: the server answers ${i.status}`);if(this.blob||this.fetching)return await i.body?.cancel(),this.get(e,t);let s=Number(i.headers.get("content-length")??0);if(s>209715200)throw await i.body?.cancel(),new Error(`${this.url}: this server sends no parts of files, and ${Math.round(s/2**20)} MiB are too many to fetch whole (limit ${209715200/2**20} MiB): use a server that answers range requests`);return this.fetching=i.blob(),this.blob=await this.fetching,this.get(e,t)}};var Wx=["station","rgb","intensity","sigma_x","sigma_y","sigma_z","sigma","incidence","distance","significance"],P2=`
in vec3 sigma;
in float intensity;
in float incidence;
in float distanceTo;
in float level;
in vec3 rgb;
uniform int uMode;
uniform vec2 uRange;
uniform vec3 uStation;
uniform bool uLacks;        // this cloud does not have what is shown
uniform vec3 uPlain;
uniform sampler2D uTable;
uniform float uSize;
uniform float uPixels;      // pixels of one metre, at one metre where the view is perspective
uniform float uSpacing;
uniform bool uFill;
uniform bool uOrtho;
uniform bool uSlice;
uniform vec3 uSliceCentre;
uniform vec3 uSliceHalf;
uniform vec2 uSliceTurn;
out vec3 vColour;

void main() {
  vec4 place = modelMatrix * vec4(position, 1.0);
  vec4 seen = viewMatrix * place;
  gl_Position = projectionMatrix * seen;
  if (uSlice) {
    vec3 d = place.xyz - uSliceCentre;
    d = vec3(uSliceTurn.x * d.x + uSliceTurn.y * d.y, uSliceTurn.x * d.y - uSliceTurn.y * d.x, d.z);
    if (any(greaterThan(abs(d), uSliceHalf))) gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
  }
  float pixels = uOrtho ? uPixels : uPixels / max(0.01, -seen.z);
  gl_PointSize = uFill ? clamp(uSize * uSpacing * pixels * 0.8, uSize, 3.0 * uSize) : uSize;
  if (uMode == 0) vColour = uStation;
  else if (uLacks) vColour = uPlain;
  else if (uMode == 1) vColour = rgb;
  else {
    float value = uMode == 2 ? intensity
      : uMode == 3 ? sigma.x
      : uMode == 4 ? sigma.y
      : uMode == 5 ? sigma.z
      : uMode == 6 ? length(sigma)
      : uMode == 7 ? incidence * 0.01
      : uMode == 8 ? distanceTo
      : distanceTo / max(level, 1e-9);
    float t = clamp((value - uRange.x) / (uRange.y - uRange.x), 0.0, 1.0);
    vColour = texture(uTable, vec2((t * 255.0 + 0.5) / 256.0, 0.5)).rgb;
  }
}`,I2=`
precision highp float;
in vec3 vColour;
uniform bool uRound;
layout(location = 0) out vec4 colour;
void main() {
  if (uRound) {
    vec2 d = gl_PointCoord - 0.5;
    if (dot(d, d) > 0.25) discard;
  }
  colour = vec4(vColour, 1.0);
}`;function Xx(){return{uMode:{value:0},uPlain:{value:new B(.62,.65,.69)},uRange:{value:new at(0,1)},uTable:{value:null},uSize:{value:2},uPixels:{value:1e3},uFill:{value:!0},uRound:{value:!1},uOrtho:{value:!1},uSlice:{value:!1},uSliceCentre:{value:new B},uSliceHalf:{value:new B(1,1,1)},uSliceTurn:{value:new at(1,0)}}}function qx(n,e){return new hi({glslVersion:Wo,vertexShader:P2,fragmentShader:I2,uniforms:{...n,uSpacing:{value:1},uLacks:{value:!1},uStation:{value:new B(...e.map(t=>t/255))}}})}function Yx(n){let e=new Bn;return e.setAttribute("position",new fn(n.position,3)),e.setAttribute("intensity",new fn(n.intensity,1)),n.sigma&&e.setAttribute("sigma",new fn(n.sigma,3)),n.incidence&&e.setAttribute("incidence",new fn(n.incidence,1)),n.distance&&e.setAttribute("distanceTo",new fn(n.distance,1)),n.level&&e.setAttribute("level",new fn(n.level,1)),n.rgb&&e.setAttribute("rgb",new fn(n.rgb,3,!0)),e}var D2=Math.max(2,Math.min(4,(navigator.hardwareConcurrency||2)-1)),N2=2,jx=1.6,Af=class{constructor(e,t,i,s,r){this.camera=t,this.changed=i,this.failed=s,this.gone=r,this.origin=e.origin,this.frame=e.frame??[[1,0,0],[0,1,0],[0,0,1]],this.budget=2e6,this.height=800,this.shared=Xx(),this.group=new ss,this.group.matrixAutoUpdate=!1,this.tables=new Map(Object.keys(jc).map(l=>[l,U2(l)])),this.shared.uTable.value=this.tables.get("viridis"),this.attribute="station";let o=(e.stations?.name??[]).filter((l,c)=>e.stations.kind[c]==="scanner"),a=[...new Set([...o,...(e.clouds??[]).map(l=>l.station)])];this.stationColours=new Map(a.map((l,c)=>[l,ul[c%ul.length]])),this.clouds=(e.clouds??[]).map(l=>this.#t(l)),this.tick=0,this.shownPoints=0,this.chosen=[],this.pending=new Map,this.task=0,this.firstAt=null,this.timer=0,this.busy=[],this.workers=Array.from({length:D2},(l,c)=>{let u=new Worker(new URL("cloud-worker.js",import.meta.url));return this.busy[c]=0,u.onmessage=h=>this.#i(c,h.data),u.onerror=h=>this.failed(`the decoder of clouds cannot start: ${h.message??"no reason is given"}`),u})}#t(e){let t=new ss;t.matrixAutoUpdate=!1,this.group.add(t);let i={entry:e,name:e.name,station:e.station,visible:!0,group:t,state:"none",nodes:new Map,source:null,header:null,layout:null,root:null,cube:null,spacing:1,material:qx(this.shared,Wd(this.stationColours.get(e.station)??ul[0])),carried:null};return this.#l(i),i}add(e){for(let t of e)this.clouds.some(i=>i.name===t.name)||(this.stationColours.has(t.station)||this.stationColours.set(t.station,ul[this.stationColours.size%ul.length]),this.clouds.push(this.#t(t)));this.soon(),this.changed()}get total(){return this.clouds.reduce((e,t)=>e+(t.visible?t.entry.points??0:0),0)}get loading(){return this.pending.size+this.clouds.filter(e=>e.state==="opening").length}async#e(e){e.state="opening";try{let t=new URL(e.entry.url,document.baseURI);if(t.origin!==location.origin)throw new Error(`${e.name}: its address is on another host`);e.source=new Ef(t.href),e.get=(r,o)=>e.source.get(r,o);let i=await Tf.Copc.create(e.get);e.layout=Gx(i.header,i.eb);let s=i.info.cube;e.cube={least:s.slice(0,3),edge:s[3]-s[0]},e.spacing=i.info.spacing,_g(e,await Tf.Copc.loadHierarchyPage(e.get,i.info.rootHierarchyPage)),e.root=e.nodes.get("0-0-0-0")??null,e.state="open"}catch(t){e.state="failed",e.unheard=!!t?.silent,this.#n(e,t?.message??t,t?.silent)}this.soon(),this.changed()}async#s(e){let t=e.page;if(e.state!=="page"){e.state="page";try{_g(e.cloud,await Tf.Copc.loadHierarchyPage(e.cloud.get,t)),e.state="none"}catch(i){e.unheard=!!i?.silent,this.#n(e.cloud,i?.message??i,i?.silent)}this.soon()}}#r(e){let t=this.origin,i=this.frame,s=[e.centre[0]-t[0],e.centre[1]-t[1],e.centre[2]-t[2]],r=i.map(o=>o[0]*s[0]+o[1]*s[1]+o[2]*s[2]);return new ht().set(i[0][0],i[0][1],i[0][2],r[0],i[1][0],i[1][1],i[1][2],r[1],i[2][0],i[2][1],i[2][2],r[2],0,0,0,1)}soon(){this.timer||(this.timer=setTimeout(()=>{this.timer=0,this.update()},40))}update(){let e=this.clouds.filter(f=>f.visible),t=e.filter(f=>f.state==="opening").length;for(let f of e)f.state==="none"&&t<6&&(t++,this.#e(f));let i=this.camera;i.updateMatrixWorld();let s=new Gs().setFromProjectionMatrix(new ht().multiplyMatrices(i.projectionMatrix,i.matrixWorldInverse)),r=new B().setFromMatrixPosition(i.matrixWorld),o=!!i.isOrthographicCamera,a=this.pixelsOfMetre(),l=new Pn,c=this.shared.uSlice.value?this.#c():null,u=f=>(f.matrix??=this.#r(f),l.center.setFromMatrixPosition(f.matrix),l.radius=f.radius,!s.intersectsSphere(l)||c&&!c.intersectsSphere(l)?0:o?a:a/Math.max(.5,r.distanceTo(l.center)-.6*f.radius)),h=e.filter(f=>f.root).map(f=>f.root),d=$x(h,{budget:this.budget,pixels:u,finest:1.2});for(let f of d.pages)this.#s(f);this.chosen=d.nodes,this.tick++;for(let f of d.nodes)f.used=this.tick;this.#o(),this.#a(),this.#u()}pixelsOfMetre(){return this.camera.projectionMatrix.elements[5]*this.height/2}#c(){let e=this.shared.uSliceHalf.value;return new Pn(this.shared.uSliceCentre.value.clone(),e.length())}#o(){let e=0;for(let i of this.clouds){for(let s of i.group.children)s.visible=!1;i.group.visible=i.visible}for(let i of this.chosen)i.points&&(i.points.visible=!0,e+=i.count);let t=i=>{let s=i.spacing;for(let r of i.children??[])r.points?.visible&&(s=Math.min(s,t(r)));return i.drawnSpacing=s,s};for(let i of this.clouds)i.root&&i.visible&&t(i.root);(e!==this.shownPoints||this.shownTick!==this.tick)&&this.changed(),this.shownPoints=e,this.shownTick=this.tick}#a(){for(let e of this.chosen){if(e.state!=="none")continue;let t=this.busy.indexOf(Math.min(...this.busy));if(this.busy[t]>=N2)return;let i=++this.task;e.state="asked",this.pending.set(i,e),this.busy[t]++;let s=e.cloud,r=s.source.blob?.slice(e.offset,e.offset+e.length)??null;this.workers[t].postMessage({task:i,url:s.source.url,blob:r,layout:s.layout,offset:e.offset,length:e.length,centre:e.centre,count:e.count})}}#l(e){e.material.uniforms.uLacks.value=this.attribute!=="station"&&!e.entry.attributes?.[this.attribute],e.material.uniformsNeedUpdate=!0}again(){for(let e of this.clouds){e.unheard&&Object.assign(e,{state:"none",unheard:!1});for(let t of e.nodes.values())t.unheard&&Object.assign(t,{state:"none",unheard:!1})}this.soon()}#n(e,t,i){i?this.gone():this.failed(`${e.name}: ${t}`)}#i(e,{task:t,columns:i,error:s,silent:r}){this.busy[e]--;let o=this.pending.get(t);if(this.pending.delete(t),!!o){if(s)o.state="failed",o.unheard=!!r,this.#n(o.cloud,s,r);else{o.state="ready",o.columns=i;let a=new bc(Yx(i),o.cloud.material);a.matrixAutoUpdate=!1,a.frustumCulled=!1,o.matrix??=this.#r(o),a.matrix.copy(o.matrix),a.matrixWorldNeedsUpdate=!0,a.userData.node=o,a.onBeforeRender=()=>{o.cloud.material.uniforms.uSpacing.value=o.drawnSpacing??o.spacing,o.cloud.material.uniformsNeedUpdate=!0},o.points=a,o.cloud.group.add(a),this.firstAt??=performance.now()}this.soon(),this.#a()}}#u(){let e=0,t=[];for(let i of this.clouds)for(let s of i.nodes.values())s.points&&(e+=s.count,s.used!==this.tick&&t.push(s));if(this.held=e,!(e<=this.budget*jx)){t.sort((i,s)=>i.used-s.used);for(let i of t){if(e<=this.budget*jx)break;e-=i.count,i.cloud.group.remove(i.points),i.points.geometry.dispose(),i.points=null,i.columns=null,i.state="none"}this.held=e}}colour(e,t){this.shared.uMode.value=Math.max(0,Wx.indexOf(e)),this.shared.uRange.value.set(t[0],t[1]>t[0]?t[1]:t[0]+1e-12),this.shared.uTable.value=this.tables.get(Xd(e)),this.attribute=e;for(let i of this.clouds)this.#l(i);this.changed()}carry(e){for(let t of this.clouds){let i=e.get(t.station),s=new ht;if(i?.before&&i.now&&i.before!==i.now){let{turn:r,shift:o}=xy(i.before,i.now,this.frame,this.origin);s.set(r[0][0],r[0][1],r[0][2],o[0],r[1][0],r[1][1],r[1][2],o[1],r[2][0],r[2][1],r[2][2],o[2],0,0,0,1)}t.group.matrix.copy(s),t.group.matrixWorldNeedsUpdate=!0}this.changed()}pick(e,t,i,s,r=8){let o=this.camera;o.updateMatrixWorld();let a=new ht().multiplyMatrices(o.projectionMatrix,o.matrixWorldInverse),l=new ht,c=new B().setFromMatrixPosition(o.matrixWorld),u=new B;o.getWorldDirection(u);let h=new B,d=this.pixelsOfMetre(),f=this.shared.uSlice.value,m=null;for(let y of this.chosen){if(!y.points||!y.cloud.visible)continue;y.points.updateWorldMatrix(!0,!1);let g=y.points.matrixWorld;h.setFromMatrixPosition(g);let p=h.clone().sub(c).dot(u);if(!o.isOrthographicCamera&&p<-y.radius)continue;let x=h.clone().project(o);if(p>y.radius*1.2||o.isOrthographicCamera){let R=o.isOrthographicCamera?d:d/Math.max(.1,p-y.radius);if(Math.hypot((x.x+1)/2*i-e,(1-x.y)/2*s-t)>y.radius*R*1.1+r)continue}let T=l.multiplyMatrices(a,g).elements,b=y.columns.position;for(let R=0;R<y.count;R++){let[A,v,E]=[b[3*R],b[3*R+1],b[3*R+2]],k=T[3]*A+T[7]*v+T[11]*E+T[15];if(k<=0)continue;let U=((T[0]*A+T[4]*v+T[8]*E+T[12])/k+1)/2*i-e,I=(1-(T[1]*A+T[5]*v+T[9]*E+T[13])/k)/2*s-t,z=U*U+I*I;if(z>r*r)continue;let H=(T[2]*A+T[6]*v+T[10]*E+T[14])/k;if(H<-1||H>1)continue;let G=(o.isOrthographicCamera?H:k)*(1+.003*Math.sqrt(z))+(o.isOrthographicCamera?5e-4*Math.sqrt(z):0);m&&G>=m.score||f&&!this.inSlice(new B(A,v,E).applyMatrix4(g))||(m={score:G,node:y,i:R,world:g})}}return m?this.described(m.node,m.i):null}inSlice(e){let t=this.shared,i=e.clone().sub(t.uSliceCentre.value),[s,r]=[t.uSliceTurn.value.x,t.uSliceTurn.value.y],o=t.uSliceHalf.value;return Math.abs(s*i.x+r*i.y)<=o.x&&Math.abs(s*i.y-r*i.x)<=o.y&&Math.abs(i.z)<=o.z}described(e,t){let i=e.columns,s=[i.position[3*t],i.position[3*t+1],i.position[3*t+2]],r=new B(...s).applyMatrix4(e.points.matrixWorld);return{cloud:e.cloud.name,station:e.cloud.station,node:e.key,index:t,xyz:s.map((o,a)=>o+e.centre[a]),draw:[r.x,r.y,r.z],sigma:i.sigma?[i.sigma[3*t],i.sigma[3*t+1],i.sigma[3*t+2]]:null,intensity:i.intensity[t],incidence:i.incidence?i.incidence[t]/100:null,distance:i.distance?i.distance[t]:null,level:i.level?i.level[t]:null,further:!!e.cloud.entry.further,rgb:i.rgb?[...i.rgb.slice(3*t,3*t+3)]:null}}};function U2(n){let e=new Bo(gy(n),256,1,Yi);return e.minFilter=e.magFilter=Rn,e.needsUpdate=!0,e}var O2=`
precision highp float;
in vec2 vAt;
uniform sampler2D uColour;
uniform sampler2D uDepth;
uniform vec2 uPixel;
uniform float uStrength;
uniform float uRadius;
uniform vec2 uNearFar;
uniform bool uOrtho;
uniform vec3 uBackground;
layout(location = 0) out vec4 colour;

float away(float depth) {
  if (uOrtho) return mix(uNearFar.x, uNearFar.y, depth);
  return uNearFar.x * uNearFar.y / (uNearFar.y - depth * (uNearFar.y - uNearFar.x));
}

void main() {
  float depth = texture(uDepth, vAt).r;
  vec3 base = texture(uColour, vAt).rgb;
  float shade = 1.0;
  if (uStrength > 0.0) {
    // how much nearer the neighbours are, by their ratio where the view is perspective
    float here = away(depth);
    float sum = 0.0;
    for (int k = 0; k < 8; k++) {
      float angle = 0.78539816 * float(k);
      float there = away(texture(uDepth, vAt + uPixel * uRadius * vec2(cos(angle), sin(angle))).r);
      sum += uOrtho ? max(0.0, here - there) * 12.0 / (uNearFar.y - uNearFar.x) : max(0.0, log2(here) - log2(there));
    }
    shade = exp(-sum / 8.0 * uStrength * 60.0);
  }
  if (depth >= 1.0) {
    colour = vec4(uBackground, 1.0);
  } else {
    colour = vec4(base * max(shade, 0.12), 1.0);
  }
  gl_FragDepth = depth;
}`,Cf=class{constructor(){this.target=new Ai(1,1,{type:di,depthBuffer:!0}),this.target.depthTexture=new Es(1,1,Oi),this.uniforms={uColour:{value:this.target.texture},uDepth:{value:this.target.depthTexture},uPixel:{value:new at},uStrength:{value:.5},uRadius:{value:1.4},uNearFar:{value:new at(.1,1e3)},uOrtho:{value:!1},uBackground:{value:new B(1,1,1)}};let e=new Bn;e.setAttribute("position",new fn(new Float32Array([-1,-1,0,3,-1,0,-1,3,0]),3));let t=new hi({glslVersion:Wo,vertexShader:"out vec2 vAt; void main() { vAt = position.xy * 0.5 + 0.5; gl_Position = vec4(position.xy, 0.0, 1.0); }",fragmentShader:O2,uniforms:this.uniforms,depthFunc:Xa}),i=new Zn(e,t);i.frustumCulled=!1,this.scene=new $s,this.scene.add(i),this.camera=new ko}size(e,t){this.target.setSize(e,t),this.uniforms.uPixel.value.set(1/e,1/t)}draw(e,t,i){e.setRenderTarget(this.target),e.setClearColor(0,0),e.clear(),e.render(t,i),e.setRenderTarget(null),this.uniforms.uNearFar.value.set(i.near,i.far),this.uniforms.uOrtho.value=!!i.isOrthographicCamera,e.clear(),e.render(this.scene,this.camera)}};var oa='-apple-system, "Segoe UI", Roboto, Ubuntu, Cantarell, "Liberation Sans", Arial, sans-serif',vg=class{constructor(e=64){this.cell=e,this.cells=new Map}#t([e,t,i,s]){let r=[];for(let o=Math.floor(e/this.cell);o<=Math.floor(i/this.cell);o++)for(let a=Math.floor(t/this.cell);a<=Math.floor(s/this.cell);a++)r.push(`${o},${a}`);return r}free(e){for(let t of this.#t(e))for(let i of this.cells.get(t)??[])if(e[0]<i[2]&&i[0]<e[2]&&e[1]<i[3]&&i[1]<e[3])return!1;return!0}take(e){for(let t of this.#t(e))this.cells.has(t)||this.cells.set(t,[]),this.cells.get(t).push(e)}};function F2(n,e,t){let i=new vg,s=[...n].sort((o,a)=>a.weight-o.weight);for(let o of s)i.take([o.x-5,o.y-5,o.x+5,o.y+5]);let r=[];for(let o of s){if(!o.text)continue;let a=e(o.text,!!o.strong),l=[[o.x+9,o.y],[o.x-9-a,o.y],[o.x-a/2,o.y-t-3],[o.x-a/2,o.y+t+3]];for(let[c,u]of l){let h=[c-2,u-t/2-1,c+a+2,u+t/2+1];if(i.free(h)){i.take(h),r.push({mark:o,x:c,y:u});break}}}return r}function B2(n,e,t){let i=e.strong?6.5:e.small?3.6:4.5;if(n.beginPath(),e.symbol==="triangle")n.moveTo(e.x,e.y-i*1.15),n.lineTo(e.x+i,e.y+i*.7),n.lineTo(e.x-i,e.y+i*.7),n.closePath();else if(e.symbol==="diamond")n.moveTo(e.x,e.y-i),n.lineTo(e.x+i,e.y),n.lineTo(e.x,e.y+i),n.lineTo(e.x-i,e.y),n.closePath();else if(e.symbol==="square")n.rect(e.x-i*.8,e.y-i*.8,i*1.6,i*1.6);else if(e.symbol==="cross"){n.moveTo(e.x-i*.8,e.y-i*.8),n.lineTo(e.x+i*.8,e.y+i*.8),n.moveTo(e.x+i*.8,e.y-i*.8),n.lineTo(e.x-i*.8,e.y+i*.8),n.strokeStyle=t,n.lineWidth=4,n.stroke(),n.strokeStyle=e.colour,n.lineWidth=1.75,n.stroke();return}else if(e.symbol==="ring"){n.arc(e.x,e.y,i+4,0,2*Math.PI),n.strokeStyle=t,n.lineWidth=4,n.stroke(),n.strokeStyle=e.colour,n.lineWidth=2,n.stroke();return}else if(e.symbol==="dot")n.arc(e.x,e.y,2.5,0,2*Math.PI);else if(e.symbol==="end"){n.arc(e.x,e.y,5.5,0,2*Math.PI),n.fillStyle=t,n.fill(),n.strokeStyle=e.colour,n.lineWidth=3,n.stroke();return}else{if(e.symbol==="plate")return;n.arc(e.x,e.y,i*.8,0,2*Math.PI)}n.fillStyle=e.colour,n.strokeStyle=t,n.lineWidth=1.75,n.fill(),n.stroke()}function Zx(n,e,t){let i=a=>`${a?700:600} 12px ${oa}`,s=(a,l)=>(n.font=i(l),n.measureText(a).width),r=e.filter(a=>a.symbol==="plate"),o=t.names?F2(e.filter(a=>a.symbol!=="plate"),s,12):[];for(let a of[...e].sort((l,c)=>l.weight-c.weight))B2(n,a,t.halo);n.textBaseline="middle",n.lineJoin="round";for(let{mark:a,x:l,y:c}of o)n.font=i(!!a.strong),n.strokeStyle=t.halo,n.lineWidth=3.5,n.strokeText(a.text,l,c),n.fillStyle=t.text,n.fillText(a.text,l,c);for(let a of r)k2(n,a,s(a.text,!0),t)}function k2(n,e,t,i){n.beginPath(),n.roundRect(e.x-t/2-8,e.y-11,t+16,22,6),n.fillStyle=i.halo,n.fill(),n.strokeStyle=e.colour,n.lineWidth=1.5,n.stroke(),n.font=`700 12px ${oa}`,n.fillStyle=i.text,n.fillText(e.text,e.x-t/2,e.y+.5)}function Jx(n,e,t,i){n.lineCap="round";for(let[s,r]of[[7,i],[3,"#0b7fab"]])n.beginPath(),n.moveTo(e[0],e[1]),n.lineTo(t[0],t[1]),n.strokeStyle=r,n.lineWidth=Number(s),n.stroke();n.lineCap="butt"}vt.enabled=!1;var Kx={light:{background:"#f3f5f7",text:"#1b2430",halo:"rgba(255,255,255,0.92)"},dark:{background:"#14181e",text:"#eef2f6",halo:"rgba(12,15,19,0.9)"}},Rf=class{constructor(e,t,i){this.host=e,this.scene=t,this.tell=i,this.frame=t.frame??[[1,0,0],[0,1,0],[0,0,1]],this.canvas=document.createElement("canvas"),this.canvas.className="picture",this.canvas.tabIndex=0,this.canvas.setAttribute("role","application"),this.canvas.setAttribute("aria-label","Three-dimensional view: arrow keys turn, plus and minus zoom, F fits all"),this.ink=document.createElement("canvas"),this.ink.className="names",this.ink.setAttribute("aria-hidden","true"),e.append(this.canvas,this.ink),this.renderer=new Bd({canvas:this.canvas,antialias:!0,alpha:!1,powerPreference:"high-performance",preserveDrawingBuffer:!0}),this.renderer.outputColorSpace=Oo,this.renderer.autoClear=!1,this.eye=new of(()=>this.#r()),this.clouds=new Af(t,this.eye.camera,()=>{this.#c(),i.loaded()},i.failed,i.gone),this.network=new dl(s=>this.toDrawing(s),this.frame,t.ellipsoid??My(t.confidence??.95)),this.cloudScene=new $s,this.cloudScene.add(this.clouds.group),this.composite=new Cf,this.marks=[],this.notes=[],this.measured=null,this.names=!0,this.slice=null,this.only="select",this.asked=!1,this.frames=0,this.theme("light"),this.box=this.#t(),this.eye.ball=this.box.getBoundingSphere(new Pn),this.eye.ball.radius=Math.max(1,this.eye.ball.radius),this.handleMeshes=[],Hy(this.canvas,this.eye,{hit:(s,r)=>this.#d(s,r),click:(s,r,o)=>i.click(this.what(s,r),o),hover:(s,r)=>this.#f(s,r),grab:(s,r)=>this.#h(s,r),visit:(s,r)=>{let o=this.#d(s,r);o&&this.eye.visit(o,this.eye.ball.radius*.3)}}),new ResizeObserver(()=>this.#s()).observe(e),this.#s(),this.home()}toDrawing(e){return Zo(this.frame,jo(e,this.scene.origin))}#t(){let e=new Fn,t=i=>i&&e.expandByPoint(new B(...this.toDrawing(i)));for(let i of this.scene.points?.xyz??[])t(i);for(let i of this.scene.stations?.xyz??[])t(i);for(let i of this.scene.clouds??[]){if(!i.bounds)continue;let[s,r]=i.bounds;for(let o of[s[0],r[0]])for(let a of[s[1],r[1]])for(let l of[s[2],r[2]])t([o,a,l])}return e.isEmpty()&&e.expandByPoint(new B(-10,-10,-2)).expandByPoint(new B(10,10,8)),e}#e(){if(this.slice){let{centre:i,half:s,turn:r}=this.slice,[o,a]=[Math.abs(Math.cos(r)),Math.abs(Math.sin(r))],l=new B(o*s[0]+a*s[1],a*s[0]+o*s[1],s[2]),c=new B(...i);return new Fn(c.clone().sub(l),c.clone().add(l))}let e=new Fn,t=i=>i&&e.expandByPoint(new B(...this.toDrawing(i)));for(let i of this.scene.points?.xyz??[])t(i);for(let i of this.scene.stations?.xyz??[])t(i);return e.isEmpty()||e.getSize(new B).length()<.1*this.eye.ball.radius?this.box:e.expandByScalar(.04*e.getSize(new B).length())}home(){this.eye.ortho=!1,this.eye.yaw=.55,this.eye.pitch=-.62,this.eye.fit(this.#e(),.9)}fit(){this.eye.fit(this.box)}look(e){this.eye.look(e,this.#e())}theme(e){this.colours=Kx[e]??Kx.light;let t=new lt(this.colours.background);this.composite.uniforms.uBackground.value.set(t.r,t.g,t.b),this.dark=e==="dark",this.draw()}#s(){let e=Math.max(1,this.host.clientWidth),t=Math.max(1,this.host.clientHeight),i=Math.min(2,window.devicePixelRatio||1);this.ratio=i,this.renderer.setPixelRatio(i),this.renderer.setSize(e,t,!1),this.ink.width=Math.round(e*i),this.ink.height=Math.round(t*i),this.composite.size(Math.round(e*i),Math.round(t*i)),this.network.size(e,t),this.clouds.height=t,this.eye.size(e,t)}#r(){this.clouds&&(this.clouds.camera=this.eye.camera,this.clouds.soon(),this.draw(),this.tell.camera())}#c(){let e=this.clouds?.shownPoints>0;!this.clouds?.loading||e!==this.anyShown?(this.anyShown=e,this.draw()):this.arrivals??=setTimeout(()=>{this.arrivals=null,this.draw()},400)}draw(){this.asked||!this.clouds||(this.asked=!0,requestAnimationFrame(()=>{this.asked=!1,this.#o()}))}#o(){let e=this.eye.camera;this.eye.apply();let t=this.clouds.shared;t.uPixels.value=this.clouds.pixelsOfMetre()*this.ratio,t.uOrtho.value=this.eye.ortho,this.composite.draw(this.renderer,this.cloudScene,e),this.renderer.render(this.network.scene,e),this.renderer.render(this.network.front,e),this.#a(),this.frames++,this.tell.drawn()}onScreen(e){let t=this.eye.camera,i=new B(...e);return!this.eye.ortho&&i.clone().sub(this.eye.at).dot(this.eye.axes().ahead)<.05?null:(i.project(t),[(i.x+1)/2*this.eye.width,(1-i.y)/2*this.eye.height])}#a(){let e=this.ink.getContext("2d");e.setTransform(this.ratio,0,0,this.ratio,0,0),e.clearRect(0,0,this.eye.width,this.eye.height),this.placed=[];let t=[];for(let i of[...this.marks,...this.notes]){if(this.slice&&!i.always&&!this.clouds.inSlice(new B(...i.at)))continue;let s=this.onScreen(i.at);if(!s)continue;let[r,o]=s;if(r<-50||o<-20||r>this.eye.width+20||o>this.eye.height+20)continue;let a={...i,x:r,y:o};t.push(a),i.what&&this.placed.push(a)}if(this.measured){let[i,s]=this.measured.map(r=>this.onScreen(r));i&&s&&Jx(e,i,s,this.colours.halo)}Zx(e,t,{text:this.colours.text,halo:this.colours.halo,ratio:this.ratio,names:this.names}),this.slice&&this.#u(e),this.#l(e),this.#n(e)}#l(e){let t=this.eye.ortho?this.eye.at:this.eye.pivot,i=1/this.eye.metresOfPixel(t),s=120/i,r=10**Math.floor(Math.log10(s)),o=s/r,a=(o>=5?5:o>=2?2:1)*r,l=a*i,[c,u]=[this.eye.width-24-l,this.eye.height-22];e.lineWidth=4,e.strokeStyle=this.colours.halo;let h=()=>{e.beginPath(),e.moveTo(c,u-5),e.lineTo(c,u),e.lineTo(c+l,u),e.lineTo(c+l,u-5),e.stroke()};h(),e.lineWidth=1.5,e.strokeStyle=this.colours.text,h();let d=`${a>=1?a:a>=.01?`${Math.round(a*100)} c`:`${Number((a*1e3).toPrecision(2))} m`}${a>=1?" ":""}m${this.eye.ortho?"":" at the pivot"}`;e.font=`11px ${oa}`,e.textBaseline="alphabetic",e.textAlign="center",e.lineWidth=3,e.strokeStyle=this.colours.halo,e.strokeText(d,Math.min(c+l/2,this.eye.width-50),u-9),e.fillStyle=this.colours.text,e.fillText(d,Math.min(c+l/2,this.eye.width-50),u-9),e.textAlign="left"}#n(e){let[t,i,s]=[this.eye.width-52,50,24],{right:r,up:o}=this.eye.axes();e.beginPath(),e.arc(t,i,s+16,0,2*Math.PI),e.fillStyle=this.dark?"rgba(20,24,30,0.6)":"rgba(255,255,255,0.66)",e.fill();let a=[["E",new B(1,0,0),"#c8372d"],["N",new B(0,1,0),"#12876a"],["U",new B(0,0,1),"#2b6cd4"]],{ahead:l}=this.eye.axes();a.sort((c,u)=>u[1].dot(l)-c[1].dot(l)),e.font=`600 10px ${oa}`,e.textBaseline="middle",e.textAlign="center";for(let[c,u,h]of a){let[d,f]=[t+u.dot(r)*s,i-u.dot(o)*s],m=Math.hypot(d-t,f-i);if(e.strokeStyle=h,e.lineWidth=2,e.beginPath(),e.moveTo(t,i),e.lineTo(d,f),e.stroke(),m<5)continue;let[y,g]=[t+(d-t)*(1+9/m),i+(f-i)*(1+9/m)];e.fillStyle=this.colours.text,e.fillText(c,y,g)}e.textAlign="left"}visit(e,t=this.eye.ball.radius*.25){this.eye.visit(new B(...e),t)}slicingBox(){this.slice=null;let e=this.#e(),t=e.getSize(new B).multiplyScalar(.55);return t.y=Math.max(.25,t.y*.12),t.z=Math.max(t.z,2),{centre:e.getCenter(new B).toArray(),half:t.toArray()}}setSlice(e){this.slice=e?.on?e:null;let t=this.clouds.shared;t.uSlice.value=!!this.slice,this.slice&&(t.uSliceCentre.value.set(...e.centre),t.uSliceHalf.value.set(...e.half),t.uSliceTurn.value.set(Math.cos(e.turn),Math.sin(e.turn))),this.network.setBox(this.slice),this.clouds.soon(),this.draw()}#i(){let{centre:e,half:t,turn:i}=this.slice,[s,r]=[Math.cos(i),Math.sin(i)],o=[[s,r,0],[-r,s,0],[0,0,1]],a=[];for(let l=0;l<3;l++)for(let c of[-1,1])a.push({k:l,sign:c,axis:o[l].map(u=>u*c),at:e.map((u,h)=>u+o[l][h]*c*t[l])});return a}handles(){return this.slice?this.#i().map(e=>({...e,screen:this.onScreen(e.at)})):[]}#u(e){for(let t of this.#i()){let i=this.onScreen(t.at);i&&(e.beginPath(),e.arc(i[0],i[1],7,0,2*Math.PI),e.fillStyle="#f28c0d",e.strokeStyle=this.colours.halo,e.lineWidth=2.5,e.fill(),e.stroke())}}#h(e,t){if(!this.slice)return null;for(let i of this.#i()){let s=this.onScreen(i.at);if(!(!s||Math.hypot(s[0]-e,s[1]-t)>11))return(r,o)=>{let a=this.onScreen(i.at),l=this.onScreen(i.at.map((p,x)=>p+i.axis[x]*.1));if(!a||!l)return;let[c,u]=[l[0]-a[0],l[1]-a[1]],h=c*c+u*u;if(h<.01)return;let d=.1*(r*c+o*u)/h,f=[...this.slice.half],m=Math.max(.025,f[i.k]+d/2),y=(m-f[i.k])*2;f[i.k]=m;let g=this.slice.centre.map((p,x)=>p+i.axis[x]*y/2);i.at=i.at.map((p,x)=>p+i.axis[x]*y),this.tell.sliced({...this.slice,centre:g,half:f})}}return null}#d(e,t){let i=this.clouds.pick(e,t,this.eye.width,this.eye.height,12);return i?new B(...i.draw):null}what(e,t,i=!0){let s=null;for(let o of this.only==="pick"?[]:this.placed??[]){let a=Math.hypot(o.x-e,o.y-t);a<11&&(!s||a<s.distance)&&(s={distance:a,...o.what})}if(s)return s;if(this.only==="select"){for(let[o,a,l]of[["ray",this.network.rays,this.network.rayLines.visible||this.network.badRays.visible],["edge",this.network.edges,this.network.edgeLines.visible]])if(l)for(let c of a){if(c.off)continue;let[u,h]=[this.onScreen(c.a),this.onScreen(c.b)];if(!u||!h)continue;let{distance:d,t:f}=Ay([e,t],u,h);d<4&&f>.02&&f<.98&&(!s||d<s.distance)&&(s={type:o,item:c,distance:d})}if(s)return s}if(!i)return null;let r=this.clouds.pick(e,t,this.eye.width,this.eye.height);return r?{type:"cloud",point:r}:null}#f(e,t){this.hoverAt=[e,t],!this.hovering&&(this.hovering=!0,requestAnimationFrame(()=>{this.hovering=!1,this.#p(...this.hoverAt)}))}#p(e,t){let i=this.what(e,t,!1),s=this.slice&&this.#h(e,t);this.canvas.classList.toggle("over",!!(i||s)),this.tell.hover(i?{...i,x:e,y:t}:null)}drawnShare(){let e=this.renderer.getContext(),[t,i]=[this.canvas.width,this.canvas.height],s=new Uint8Array(4*t*i);this.#o(),e.readPixels(0,0,t,i,e.RGBA,e.UNSIGNED_BYTE,s);let r=this.composite.uniforms.uBackground.value.toArray().map(a=>Math.round(a*255)),o=0;for(let a=0;a<s.length;a+=4)Math.abs(s[a]-r[0])+Math.abs(s[a+1]-r[1])+Math.abs(s[a+2]-r[2])>12&&o++;return o/(t*i)}};var eb=function(n,e,t,i){var s;e[0]=0;for(var r=1;r<e.length;r++){var o=e[r++],a=e[r]?(e[0]|=o?1:2,t[e[r++]]):e[++r];o===3?i[0]=a:o===4?i[1]=Object.assign(i[1]||{},a):o===5?(i[1]=i[1]||{})[e[++r]]=a:o===6?i[1][e[++r]]+=a+"":o?(s=n.apply(a,eb(n,a,t,["",null])),i.push(s),a[0]?e[0]|=2:(e[r-2]=0,e[r]=s)):i.push(a)}return i},Qx=new Map;function tb(n){var e=Qx.get(this);return e||(e=new Map,Qx.set(this,e)),(e=eb(this,e.get(n)||(e.set(n,e=(function(t){for(var i,s,r=1,o="",a="",l=[0],c=function(d){r===1&&(d||(o=o.replace(/^\s*\n\s*|\s*\n\s*$/g,"")))?l.push(0,d,o):r===3&&(d||o)?(l.push(3,d,o),r=2):r===2&&o==="..."&&d?l.push(4,d,0):r===2&&o&&!d?l.push(5,0,!0,o):r>=5&&((o||!d&&r===5)&&(l.push(r,0,o,s),r=6),d&&(l.push(r,d,0,s),r=6)),o=""},u=0;u<t.length;u++){u&&(r===1&&c(),c(u));for(var h=0;h<t[u].length;h++)i=t[u][h],r===1?i==="<"?(c(),l=[l],r=3):o+=i:r===4?o==="--"&&i===">"?(r=1,o=""):o=i+o[0]:a?i===a?a="":o+=i:i==='"'||i==="'"?a=i:i===">"?(c(),r=1):r&&(i==="="?(r=5,s=o,o=""):i==="/"&&(r<5||t[u][h+1]===">")?(c(),r===3&&(l=l[0]),r=l,(l=l[0]).push(2,0,r),r=0):i===" "||i==="	"||i===`
`||i==="\r"?(c(),r=2):o+=i),r===3&&o==="!--"&&(r=4,l=l[0])}return c(),l})(n)),e),arguments,[])).length>1?e:e[0]}var D=tb.bind(Du),z2={undo:"M9 14 4 9l5-5M4 9h10a6 6 0 0 1 0 12h-3",redo:"m15 14 5-5-5-5M20 9H10a6 6 0 0 0 0 12h3",save:"M5 3h11l3 3v15H5zM8 3v6h8V3M8 21v-7h8v7",run:"M7 4v16l13-8z",stop:"M6 6h12v12H6z",sun:"M12 8a4 4 0 1 0 0 8 4 4 0 0 0 0-8M12 2v3M12 19v3M2 12h3M19 12h3M5 5l2 2M17 17l2 2M5 19l2-2M17 7l2-2",moon:"M20 14A8 8 0 0 1 10 4a8 8 0 1 0 10 10",link:"M10 14a4 4 0 0 0 6 0l3-3a4 4 0 0 0-6-6l-1 1M14 10a4 4 0 0 0-6 0l-3 3a4 4 0 0 0 6 6l1-1",layers:"m12 3 9 5-9 5-9-5zM3 13l9 5 9-5",table:"M3 5h18v14H3zM3 10h18M3 15h18M9 5v14",fit:"M4 9V4h5M20 9V4h-5M4 15v5h5M20 15v5h-5",home:"m3 11 9-7 9 7M6 9v11h12V9",ruler:"m3 16 13-13 5 5L8 21zM7 12l2 2M10 9l2 2M13 6l2 2",pick:"M12 2v6M12 16v6M2 12h6M16 12h6",arrow:"m5 3 14 8-6 2-2 6z",close:"M5 5l14 14M19 5 5 19",copy:"M9 9h11v11H9zM5 15H4V4h11v1"};function vi({name:n}){return D`<svg viewBox="0 0 24 24" class="icon" aria-hidden="true"><path d=${z2[n]} /></svg>`}function du({label:n,value:e,kind:t="",title:i="",act:s=null}){let r=D`<span class="chip-label">${n}</span><span class="chip-value">${e}</span>`;return s?D`<button type="button" class=${`chip ${t}`} title=${i} onClick=${s}>${r}</button>`:D`<span class=${`chip ${t}`} title=${i}>${r}</span>`}function V2(n){let e=n.global_test;if(!e)return{value:"no redundancy",kind:"warn",title:"The global test needs redundancy."};let t=`v'Pv = ${Ft(e.statistic,1)}, limits ${Ft(e.lower,1)} to ${Ft(e.upper,1)}`;return e.accepted?{value:"accepted",kind:"good",title:t}:{value:"rejected",kind:"bad",title:t}}function nb({does:n}){let e=Ue.value,t=vl.value;if(!e||!t)return D`<header class="top"></header>`;let i=V2(t),s=wt.value,r=uo.value.length,o=ho.value.length,a=s?.running,l=Jd.value||Qo.value;return D`<header class="top">
    <svg viewBox="0 0 32 32" class="brand" aria-hidden="true">
      <path class="plate" d="M16 3 29 26H3z" /><circle cx="16" cy="18" r="4.4" class="bull" />
    </svg>
    <div class="title"><strong>${e.title}</strong><span>${e.datum}</span></div>
    <div class="chips" role="status">
      <${du} label="σ₀" value=${Ft(t.posterior,3)} title="sigma of unit weight, a posteriori; a priori ${Ft(t.prior,3)}" />
      <${du} label="dof" value=${t.dof} title="degrees of freedom" />
      <${du} label="global test" value=${i.value} kind=${i.kind} title=${i.title} />
      <${du} label=${r===1?"edit":"edits"} value=${r} kind=${r?"warn":""} title="decisions kept beside the project" act=${()=>pi.value="changes"} />
      <${du} label=${o===1?"warning":"warnings"} value=${o} kind=${o?"warn":""} title="what the program warns of" act=${()=>pi.value="notes"} />
    </div>
    <div class="tools">
      ${s&&D`<button type="button" class="tool" title="Undo (Ctrl+Z)" disabled=${!s.undo||l} onClick=${n.undo}><${vi} name="undo" /><span class="sr">Undo</span></button>
        <button type="button" class="tool" title="Redo (Ctrl+Shift+Z)" disabled=${!s.redo||l} onClick=${n.redo}><${vi} name="redo" /><span class="sr">Redo</span></button>
        <button type="button" class=${`tool ${s.saved?"":"due"}`} title="Keep the decisions in edits.toml (Ctrl+S)" disabled=${s.saved||l} onClick=${n.save}>
          <${vi} name="save" /><span>${s.saved?"Saved":"Save"}</span>
        </button>
        ${a?D`<button type="button" class="tool" title="Stop the run" disabled=${s.stopping} onClick=${n.cancel}><${vi} name="stop" /><span>${s.stopping?"Stopping":"Cancel"}</span></button>`:D`<button type="button" class="tool primary" title="Run the project: new clouds with new sigmas" disabled=${l} onClick=${n.run}><${vi} name="run" /><span>Run</span></button>`}`}
      <button type="button" class="tool" title="Copy a link to this view" onClick=${n.link}><${vi} name="link" /><span class="sr">Copy link</span></button>
      <button type="button" class="tool" title=${Fi.value==="dark"?"Light theme":"Dark theme"} onClick=${()=>Fi.value=Fi.value==="dark"?"light":"dark"}>
        <${vi} name=${Fi.value==="dark"?"sun":"moon"} /><span class="sr">Theme</span>
      </button>
      <button type="button" class=${`tool narrow ${Ir.value?"active":""}`} title="Layers and colours" aria-pressed=${Ir.value} onClick=${()=>Ir.value=!Ir.value}><${vi} name="layers" /><span class="sr">Layers</span></button>
      <button type="button" class=${`tool narrow ${co.value?"active":""}`} title="Tables" aria-pressed=${co.value} onClick=${()=>co.value=!co.value}><${vi} name="table" /><span class="sr">Tables</span></button>
    </div>
  </header>`}function H2(){let n=wt.value;if(!nu.value)return D`<div class="banner bad" role="alert"><p><b>The web server does not answer.</b> What was loaded can still be looked at.</p></div>`;let e=n?"tribrach workbench PROJECT.toml":"tribrach view FOLDER",t=n&&!n.saved?D`<p>Decisions that were not saved are lost with it.</p>`:"";return D`<div class="banner bad gone" role="alert"><div>
    ${Qo.value?D`<p><b>The program has ended.</b> What was loaded can still be looked at. To go on, start it again (<code>${e}</code>) and open the address that it prints.</p>${t}`:D`<p><b>The program does not answer.</b> The page asks again by itself. If it was ended, start it again (<code>${e}</code>) and open the address that it prints.</p>`}
  </div></div>`}function ib({does:n}){let e=[],t=Ue.value.lacking;if(Js.value&&e.push(D`<div class="banner bad" role="alert" key="defect">
      <div>${Js.value.map(i=>D`<p>${i}</p>`)}<p>The network stays as it was before.</p></div>
      <button type="button" class="button" onClick=${n.closeDefect}>Close</button>
    </div>`),Cr.value){let i=Cr.value,s=wt.value?.stopping;e.push(D`<div class="banner" role="status" key="progress">
      <div><p>${s?"Stopping, at the next place where it can: ":wt.value?.running?"":"Preparing clouds: "}${i.what??"Running"}${i.total?`, ${Gt(i.done??0)} of ${Gt(i.total)}`:""}</p>
        <progress max=${i.total||void 0} value=${i.total?i.done??0:void 0}></progress></div>
      ${wt.value?.running&&D`<button type="button" class="button" disabled=${s} onClick=${n.cancel}>${s?"Stopping …":"Cancel"}</button>`}
    </div>`)}else t&&!Km.value?e.push(D`<div class="banner quiet" role="status" key="lacking"><p>${t}</p>
      <button type="button" class="button plain" aria-label="Close" onClick=${()=>Km.value=!0}><${vi} name="close" /></button></div>`):wt.value?.ran&&su.value.some(i=>i.long>ji)&&e.push(D`<div class="banner quiet" key="moved">
      <p>Positions moved, sigmas of the last run. <span class="muted">Run writes the clouds anew.</span></p>
    </div>`);Pi.value==="measure"&&e.push(D`<div class="banner hint" role="status" key="measure">
      <p><b>Distance:</b> ${Qs.value.length===0?"choose the first end":`from ${Qs.value[0].name??"a point of the cloud"}; choose the other end`}
        <span class="muted"> in the picture or in the list of points</span></p>
      <button type="button" class="button plain" onClick=${n.endMeasure}>Cancel</button>
    </div>`),(Qo.value||!pl.value)&&e.unshift(D`<${H2} key="gone" />`);for(let i of Ko.value)e.push(D`<div class=${`banner ${i.kind==="error"?"bad":""}`} role=${i.kind==="error"?"alert":"status"} key=${i.id}>
      <p>${i.words}</p><button type="button" class="button plain" aria-label="Close" onClick=${()=>eg(i.id)}><${vi} name="close" /></button>
    </div>`);return D`<div class="banners">${e}</div>`}function Tl({title:n,children:e,open:t=!0}){return D`<details class="section" open=${t}><summary>${n}</summary><div class="section-body">${e}</div></details>`}function fu({label:n,checked:e,change:t,hint:i=null,disabled:s=!1,swatch:r=null}){return D`<label class=${`check ${s?"off":""}`}>
    <input type="checkbox" checked=${e} disabled=${s} onChange=${o=>t(o.currentTarget.checked)} />
    ${r&&D`<i class="swatch" style=${{background:r}}></i>`}
    <span class="grow">${n}</span>${i!==null&&D`<span class="hint">${i}</span>`}
  </label>`}function Pf({label:n,value:e,min:t,max:i,step:s,show:r,change:o}){return D`<label class="slider"><span class="slider-head"><span>${n}</span><output>${r(e)}</output></span>
    <input type="range" min=${t} max=${i} step=${s} value=${e} onInput=${a=>o(Number(a.currentTarget.value))} /></label>`}function Al({label:n,value:e,change:t,unit:i="",step:s="any",min:r=void 0}){return D`<label class="field"><span>${n}</span>
    <input type="number" step=${s} min=${r} value=${e} onChange=${o=>{let a=Number(o.currentTarget.value);o.currentTarget.value!==""&&Number.isFinite(a)&&t(a)}} />${i&&D`<span class="unit">${i}</span>`}</label>`}function $2(){let n=Ue.value,e={points:n.points.name.length,stations:n.stations.name.length,ellipsoids:yn.value.filter(t=>t.covariance).length,rays:n.rays?.from?.length??0,edges:n.edges?.length??0,planes:n.planes?.name?.length??0,moves:na.value.filter(t=>t.long>ji).length,epochs:Rs.value.length,rejected:(n.rejected?.scan?.length??0)+Qd.value.length,comparisons:(n.comparisons??[]).reduce((t,i)=>t+(i.sites??[]).filter(s=>s.xyz).length,0)};return Uy.filter(([t])=>t!=="epochs"||e.epochs>0).map(([t,i])=>D`<${fu} key=${t} label=${i} checked=${en(t)} hint=${e[t]??null}
    disabled=${e[t]===0} change=${s=>iu(t,s)} />`)}function G2({colours:n}){let e=Ue.value,t=(e.clouds??[]).filter(l=>!l.further),i=(e.clouds??[]).filter(l=>l.further),s=l=>D`<${fu} key=${l.name} label=${l.name.replace(/^\+/,"")} checked=${en(`scan:${l.name}`)}
      swatch=${n?.get(l.station)} hint=${Gt(l.points)} change=${c=>iu(`scan:${l.name}`,c)} />`,r=t.map(l=>`scan:${l.name}`),o=r.every(l=>en(l)),a=l=>{let c=new Set(Tr.value);for(let u of r)l?c.delete(u):c.add(u);Tr.value=c};return D`${t.length>1&&D`<${fu} label="All scans" checked=${o} hint=${Gt(t.reduce((l,c)=>l+c.points,0))} change=${a} />`}
    <div class="scans">${t.map(s)}</div>
    ${i.length>0&&D`<p class="muted small sub">Given besides</p>${i.map(s)}`}
    ${(e.pending??[]).map(l=>D`<p class="muted small" key=${l}>${l}: is being prepared</p>`)}
    ${!t.length&&!i.length&&!(e.pending??[]).length&&D`<p class="muted small">${e.lacking||"This result has no clouds."}</p>`}`}var W2={station:"Station",rgb:"RGB",intensity:"Intensity",sigma:"Sigma of position",sigma_x:"Sigma x",sigma_y:"Sigma y",sigma_z:"Sigma z",incidence:"Incidence",distance:"Distance"};function yg(n){return n?.unit==="m"?sg("m",""):{unit:n?.unit??"",factor:1,digits:2}}function xg(n){let t=Lr.value.get(n)?.title;return t?t.charAt(0).toUpperCase()+t.slice(1):W2[n]??Bi(n)}function X2(){let n=Lr.value,e=["sigma","sigma_x","sigma_y","sigma_z","incidence","intensity","rgb","distance","significance"].filter(c=>n.has(c)),t=Kn.value,i=n.get(t),s=yg(i),[r,o]=sa.value,a=c=>Zs.value={...Zs.value,[t]:c},l=c=>Number((c*s.factor).toPrecision(4));return D`<label class="field wide"><span>By</span>
      <select value=${t} onChange=${c=>{ml.value=!0,Kn.value=c.currentTarget.value}}>
        <option value="station" selected=${t==="station"}>Station</option>
        ${e.map(c=>D`<option key=${c} value=${c} selected=${t===c}>${xg(c)}</option>`)}
      </select></label>
    ${i?.low!==void 0&&D`<div class="pair">
      <${Al} label=${s.unit?`from [${s.unit}]`:"from"} value=${l(r)} change=${c=>c/s.factor<o&&a([c/s.factor,o])} />
      <${Al} label=${s.unit?`to [${s.unit}]`:"to"} value=${l(o)} change=${c=>c/s.factor>r&&a([r,c/s.factor])} />
      ${Zs.value[t]&&D`<button type="button" class="button plain" onClick=${()=>{let{[t]:c,...u}=Zs.value;Zs.value=u}}>from the data</button>`}</div>`}`}function q2({does:n}){let e=Jn.value,t=o=>Jn.value={...e,...o},i=["E","N","U"],s=Ue.value.origin,r=n.upright;return D`<${fu} label="Slice box" checked=${!!e?.on} change=${o=>n.slice(o)} />
    ${e?.on&&D`<div class="grid3">
        ${i.map((o,a)=>D`<${Al} key=${`c${o}`} label=${o} step="0.1" value=${Number((e.centre[a]+(r?s[a]:0)).toFixed(3))}
          change=${l=>t({centre:e.centre.map((c,u)=>u===a?l-(r?s[a]:0):c)})} />`)}
        ${["width","depth","height"].map((o,a)=>D`<${Al} key=${o} label=${o} step="0.1" min="0.05" value=${Number((2*e.half[a]).toFixed(3))}
          change=${l=>l>0&&t({half:e.half.map((c,u)=>u===a?l/2:c)})} />`)}
      </div>
      <${Pf} label="Turn" value=${Math.round(e.turn*180/Math.PI)} min="-90" max="90" step="1" show=${o=>`${o}°`}
        change=${o=>t({turn:o*Math.PI/180})} />
      <p class="muted small">Metres${r?"":", about the origin of the drawing"}. Drag the orange handles in the picture.</p>`}`}function Y2({does:n}){let[e,t]=ei(""),i=Object.keys(ea.value);return D`<div class="buttons">
      ${Object.entries(cu).map(([s,r])=>D`<button type="button" key=${s} class="button" title=${r.title} onClick=${()=>n.look(s)}>${s==="plan"?"Plan":s.charAt(0).toUpperCase()}</button>`)}
    </div>
    <div class="buttons">
      <button type="button" class="button" onClick=${n.home} title="Back to the first view (R)">Reset</button>
      <button type="button" class="button" onClick=${n.fit} title="Everything in the picture (F)">Fit all</button>
      <button type="button" class="button" onClick=${n.project} title="Perspective or parallel (P)">${Kd.value?"Perspective":"Parallel"}</button>
    </div>
    ${i.length>0&&D`<ul class="plain-list">${i.map(s=>D`<li key=${s}><button type="button" class="button plain" onClick=${()=>n.open(ea.value[s])}>${s}</button></li>`)}</ul>`}
    ${n.canSave&&D`<form class="inline" onSubmit=${s=>{s.preventDefault(),e.trim()&&n.keep(e.trim()),t("")}}><input type="text" maxlength="80" placeholder="Name of this view" aria-label="Name of this view" value=${e} onInput=${s=>t(s.currentTarget.value)} />
      <button type="submit" class="button" disabled=${!e.trim()}>Keep</button></form>`}`}function sb({does:n,colours:e}){return Ue.value?D`<aside class=${`left ${Ir.value?"":"shut"}`} aria-label="Layers and colours">
    <${Tl} title="Layers"><${$2} /><//>
    <${Tl} title="Scans"><${G2} colours=${Kn.value==="station"?e:null} /><//>
    <${Tl} title="Colour"><${X2} /><//>
    <${Tl} title="View"><${Y2} does=${n} /><//>
    <${Tl} title="Slice" open=${!!Jn.value}><${q2} does=${n} /><//>
    <${Tl} title="Drawing">
      <${Pf} label="Point size" value=${ao.value} min="1" max="8" step="0.5" show=${t=>`${t} px`} change=${t=>ao.value=t} />
      <${Pf} label="Point budget" value=${Math.log10(_l.value)} min="4.7" max="7" step="0.05" show=${t=>`${(10**t/1e6).toFixed(t<6?2:1)} M`} change=${t=>_l.value=Math.round(10**t)} />
      <${Pf} label="Shading of edges" value=${ta.value} min="0" max="1.5" step="0.1" show=${t=>t?t.toFixed(1):"off"} change=${t=>ta.value=t} />
      <${fu} label="Larger points where they are sparse" checked=${gl.value} change=${t=>gl.value=t} />
      <div class="pair">
        <${Al} label="Ellipsoids ×" value=${Rr.value||xl.value} min="1" change=${t=>Rr.value=t>0?t:0} />
        <${Al} label="Moves ×" value=${Pr.value||yl.value} min="1" change=${t=>Pr.value=t>0?t:0} />
      </div>
    <//>
  </aside>`:null}function j2(){let n=Kn.value,e=Lr.value.get(n);if(e?.low===void 0)return null;let t=yg(e),[i,s]=sa.value.map(a=>a*t.factor),r=zy(i,s,5),o=jc[Xd(n)];return D`<div class="legend-scale">
    <div class="legend-title">${xg(n)}${t.unit&&D` <span class="muted">[${t.unit}]</span>`}</div>
    <div class="ramp" style=${{background:`linear-gradient(to right, ${o.join(", ")})`}}></div>
    <div class="ramp-ticks">${r.ticks.map(a=>D`<span key=${a} style=${{left:`${100*(a-i)/(s-i)}%`}}>${ky(a,r.step)}</span>`)}</div>
  </div>`}function Z2({colours:n}){return D`<div class="legend-keys">${[...n].map(([e,t])=>D`<span key=${e}><i class="swatch" style=${{background:t}}></i>${e}</span>`)}</div>`}var rb={triangle:"M7 1 13 12H1z",diamond:"M7 1 13 7 7 13 1 7z",circle:"M7 2a5 5 0 1 0 0 10A5 5 0 1 0 7 2",square:"M2.5 2.5h9v9h-9z"};function ob({colours:n}){let e=Ue.value;if(!e)return null;let t=["control","check","free"].filter(s=>yn.value.some(r=>r.role===s)),i=en("rays")&&nf.value.length>0;return D`<div class="legend card">
    ${Kn.value==="station"?D`<${Z2} colours=${n} />`:D`<${j2} />`}
    <div class="legend-keys">
      ${en("points")&&t.map(s=>D`<span key=${s}><svg viewBox="0 0 14 14" class="mark"><path d=${rb[as[s].symbol]} fill=${as[s].colour} /></svg>${as[s].title}</span>`)}
      ${en("stations")&&D`<span><svg viewBox="0 0 14 14" class="mark"><path d=${rb.square} fill=${as.station.colour} /></svg>station</span>`}
      ${i&&D`<span title="largest |w| of the observations between two places"><i class="line quiet"></i>|w| below 2</span><span><i class="line warm"></i>2 to 3</span><span><i class="line bad"></i>suspicious</span>`}
    </div>
    <div class="legend-notes">
      ${en("ellipsoids")&&D`<span>Ellipsoids of ${Math.round((e.confidence??.95)*1e3)/10} %, drawn <b>${Gt(Rr.value||xl.value)} times</b></span>`}
      ${en("epochs")&&Rs.value.length>0&&D`<span class="legend-keys">${Object.entries(hl).filter(([s])=>Rs.value.some(r=>r.verdict===s)).map(([s,r])=>D`<span key=${s}><i class="line" style=${{borderColor:r.colour}}></i>${s}</span>`)}</span>
        <span>displacements, drawn <b>${Gt(tf.value)} times</b></span>`}
      ${en("moves")&&na.value.some(s=>s.long>ji)&&D`<span class="moves-note"><i class="line move"></i><span>moves${Ar.value?` from ${ia(Ar.value.a)} to ${ia(Ar.value.b)}`:""}, drawn <b>${Gt(Pr.value||yl.value)} times</b></span></span>`}
    </div>
  </div>`}function ab(){let{points:n,total:e,loading:t}=lo.value;return Ue.value?.clouds?.length?D`<div class="hud" role="status"><b>${Gt(n)}</b> of ${Gt(e)} points shown${Jn.value?.on?", less what the slice cuts off":""}${t?D`<span class="spin" aria-label="loading"></span>`:""}</div>`:null}var J2="uplot",K2="u-hz",Q2="u-vt",eP="u-title",tP="u-wrap",nP="u-under",iP="u-over",sP="u-axis",ca="u-off",rP="u-select",oP="u-cursor-x",aP="u-cursor-y",lP="u-cursor-pt",cP="u-legend",uP="u-live",hP="u-inline",dP="u-series",fP="u-marker",lb="u-label",pP="u-value",mu="width",gu="height";var cb="bottom",Cl="left",bg="right",Bg="#000",ub=Bg+"0",Sg="mousemove",hb="mousedown",Mg="mouseup",db="mouseenter",fb="mouseleave",pb="dblclick",mP="resize",gP="scroll",mb="change",Uf="dppxchange",kg="--",Ul=typeof window<"u",Cg=Ul?document:null,Pl=Ul?window:null,_P=Ul?navigator:null,Ct,If;function Rg(){let n=devicePixelRatio;Ct!=n&&(Ct=n,If&&Ig(mb,If,Rg),If=matchMedia(`(min-resolution: ${Ct-.001}dppx) and (max-resolution: ${Ct+.001}dppx)`),ua(mb,If,Rg),Pl.dispatchEvent(new CustomEvent(Uf)))}function Ji(n,e){if(e!=null){let t=n.classList;!t.contains(e)&&t.add(e)}}function Pg(n,e){let t=n.classList;t.contains(e)&&t.remove(e)}function tn(n,e,t){n.style[e]=t+"px"}function Ps(n,e,t,i){let s=Cg.createElement(n);return e!=null&&Ji(s,e),t?.insertBefore(s,i),s}function fs(n,e){return Ps("div",n,e)}var gb=new WeakMap;function sr(n,e,t,i,s){let r="translate("+e+"px,"+t+"px)",o=gb.get(n);r!=o&&(n.style.transform=r,gb.set(n,r),e<0||t<0||e>i||t>s?Ji(n,ca):Pg(n,ca))}var _b=new WeakMap;function vb(n,e,t){let i=e+t,s=_b.get(n);i!=s&&(_b.set(n,i),n.style.background=e,n.style.borderColor=t)}var yb=new WeakMap;function xb(n,e,t,i){let s=e+""+t,r=yb.get(n);s!=r&&(yb.set(n,s),n.style.height=t+"px",n.style.width=e+"px",n.style.marginLeft=i?-e/2+"px":0,n.style.marginTop=i?-t/2+"px":0)}var zg={passive:!0},vP={...zg,capture:!0};function ua(n,e,t,i){e.addEventListener(n,t,i?vP:zg)}function Ig(n,e,t,i){e.removeEventListener(n,t,zg)}Ul&&Rg();function Is(n,e,t,i){let s;t=t||0,i=i||e.length-1;let r=i<=2147483647;for(;i-t>1;)s=r?t+i>>1:Ki((t+i)/2),e[s]<n?t=s:i=s;return n-e[t]<=e[i]-n?t:i}function Yb(n){return(t,i,s)=>{let r=-1,o=-1;for(let a=i;a<=s;a++)if(n(t[a])){r=a;break}for(let a=s;a>=i;a--)if(n(t[a])){o=a;break}return[r,o]}}var jb=n=>n!=null,Zb=n=>n!=null&&n>0,Bf=Yb(jb),yP=Yb(Zb);function xP(n,e,t,i=0,s=!1){let r=s?yP:Bf,o=s?Zb:jb;[e,t]=r(n,e,t);let a=n[e],l=n[e];if(e>-1)if(i==1)a=n[e],l=n[t];else if(i==-1)a=n[t],l=n[e];else for(let c=e;c<=t;c++){let u=n[c];o(u)&&(u<a?a=u:u>l&&(l=u))}return[a??Wt,l??-Wt]}function kf(n,e,t,i){let s=Mb(n),r=Mb(e);n==e&&(s==-1?(n*=t,e/=t):(n/=t,e*=t));let o=t==10?Dr:Jb,a=s==1?Ki:ps,l=r==1?ps:Ki,c=a(o(Hn(n))),u=l(o(Hn(e))),h=Il(t,c),d=Il(t,u);return t==10&&(c<0&&(h=Xt(h,-c)),u<0&&(d=Xt(d,-u))),i||t==2?(n=h*s,e=d*r):(n=tS(n,h),e=zf(e,d)),[n,e]}function Vg(n,e,t,i){let s=kf(n,e,t,i);return n==0&&(s[0]=0),e==0&&(s[1]=0),s}var Hg=.1,bb={mode:3,pad:Hg},vu={pad:0,soft:null,mode:0},bP={min:vu,max:vu};function Of(n,e,t,i){return Vf(t)?Sb(n,e,t):(vu.pad=t,vu.soft=i?0:null,vu.mode=i?3:0,Sb(n,e,bP))}function Tt(n,e){return n??e}function SP(n,e,t){for(e=Tt(e,0),t=Tt(t,n.length-1);e<=t;){if(n[e]!=null)return!0;e++}return!1}function Sb(n,e,t){let i=t.min,s=t.max,r=Tt(i.pad,0),o=Tt(s.pad,0),a=Tt(i.hard,-Wt),l=Tt(s.hard,Wt),c=Tt(i.soft,Wt),u=Tt(s.soft,-Wt),h=Tt(i.mode,0),d=Tt(s.mode,0),f=e-n,m=Dr(f),y=Ni(Hn(n),Hn(e)),g=Dr(y),p=Hn(g-m);(f<1e-24||p>10)&&(f=0,(n==0||e==0)&&(f=1e-24,h==2&&c!=Wt&&(r=0),d==2&&u!=-Wt&&(o=0)));let x=f||y||1e3,T=Dr(x),b=Il(10,Ki(T)),R=x*(f==0?n==0?.1:1:r),A=Xt(tS(n-R,b/10),24),v=n>=c&&(h==1||h==3&&A<=c||h==2&&A>=c)?c:Wt,E=Ni(a,A<v&&n>=v?v:Ls(v,A)),k=x*(f==0?e==0?.1:1:o),U=Xt(zf(e+k,b/10),24),I=e<=u&&(d==1||d==3&&U>=u||d==2&&U<=u)?u:-Wt,z=Ls(l,U>I&&e<=I?I:Ni(I,U));return E==z&&E==0&&(z=100),[E,z]}var MP=new Intl.NumberFormat(Ul?_P.language:"en-US"),$g=n=>MP.format(n),Qi=Math,Nf=Qi.PI,Hn=Qi.abs,Ki=Qi.floor,Vn=Qi.round,ps=Qi.ceil,Ls=Qi.min,Ni=Qi.max,Il=Qi.pow,Mb=Qi.sign,Dr=Qi.log10,Jb=Qi.log2,wP=(n,e=1)=>Qi.sinh(n)*e,wg=(n,e=1)=>Qi.asinh(n/e),Wt=1/0;function wb(n){return(Dr((n^n>>31)-(n>>31))|0)+1}function Lg(n,e,t){return Ls(Ni(n,e),t)}function Kb(n){return typeof n=="function"}function St(n){return Kb(n)?n:()=>n}var EP=()=>{},Qb=n=>n,eS=(n,e)=>e,TP=n=>null,Eb=n=>!0,Tb=(n,e)=>n==e,AP=/\.\d*?(?=9{6,}|0{6,})/gm,ha=n=>{if(iS(n)||xo.has(n))return n;let e=`${n}`,t=e.match(AP);if(t==null)return n;let i=t[0].length-1;if(e.indexOf("e-")!=-1){let[s,r]=e.split("e");return+`${ha(s)}e${r}`}return Xt(n,i)};function aa(n,e){return ha(Xt(ha(n/e))*e)}function zf(n,e){return ha(ps(ha(n/e))*e)}function tS(n,e){return ha(Ki(ha(n/e))*e)}function Xt(n,e=0){if(iS(n))return n;let t=10**e,i=n*t*(1+Number.EPSILON);return Vn(i)/t}var xo=new Map;function nS(n){return((""+n).split(".")[1]||"").length}function xu(n,e,t,i){let s=[],r=i.map(nS);for(let o=e;o<t;o++){let a=Hn(o),l=Xt(Il(n,o),a);for(let c=0;c<i.length;c++){let u=n==10?+`${i[c]}e${o}`:i[c]*l,h=(o>=0?0:a)+(o>=r[c]?0:r[c]),d=n==10?u:Xt(u,h);s.push(d),xo.set(d,h)}}return s}var yu={},Gg=[],Ll=[null,null],yo=Array.isArray,iS=Number.isInteger,CP=n=>n===void 0;function Ab(n){return typeof n=="string"}function Vf(n){let e=!1;if(n!=null){let t=n.constructor;e=t==null||t==Object}return e}function RP(n){return n!=null&&typeof n=="object"}var PP=Object.getPrototypeOf(Uint8Array),sS="__proto__";function Dl(n,e=Vf){let t;if(yo(n)){let i=n.find(s=>s!=null);if(yo(i)||e(i)){t=Array(n.length);for(let s=0;s<n.length;s++)t[s]=Dl(n[s],e)}else t=n.slice()}else if(n instanceof PP)t=n.slice();else if(e(n)){t={};for(let i in n)i!=sS&&(t[i]=Dl(n[i],e))}else t=n;return t}function Ln(n){let e=arguments;for(let t=1;t<e.length;t++){let i=e[t];for(let s in i)s!=sS&&(Vf(n[s])?Ln(n[s],Dl(i[s])):n[s]=Dl(i[s]))}return n}var IP=0,LP=1,DP=2;function NP(n,e,t){for(let i=0,s,r=-1;i<e.length;i++){let o=e[i];if(o>r){for(s=o-1;s>=0&&n[s]==null;)n[s--]=null;for(s=o+1;s<t&&n[s]==null;)n[r=s++]=null}}}function UP(n,e){if(BP(n)){let o=n[0].slice();for(let a=1;a<n.length;a++)o.push(...n[a].slice(1));return kP(o[0])||(o=FP(o)),o}let t=new Set;for(let o=0;o<n.length;o++){let l=n[o][0],c=l.length;for(let u=0;u<c;u++)t.add(l[u])}let i=[Array.from(t).sort((o,a)=>o-a)],s=i[0].length,r=new Map;for(let o=0;o<s;o++)r.set(i[0][o],o);for(let o=0;o<n.length;o++){let a=n[o],l=a[0];for(let c=1;c<a.length;c++){let u=a[c],h=Array(s).fill(void 0),d=e?e[o][c]:LP,f=[];for(let m=0;m<u.length;m++){let y=u[m],g=r.get(l[m]);y===null?d!=IP&&(h[g]=y,d==DP&&f.push(g)):h[g]=y}NP(h,f,s),i.push(h)}}return i}var OP=typeof queueMicrotask>"u"?n=>Promise.resolve().then(n):queueMicrotask;function FP(n){let e=n[0],t=e.length,i=Array(t);for(let r=0;r<i.length;r++)i[r]=r;i.sort((r,o)=>e[r]-e[o]);let s=[];for(let r=0;r<n.length;r++){let o=n[r],a=Array(t);for(let l=0;l<t;l++)a[l]=o[i[l]];s.push(a)}return s}function BP(n){let e=n[0][0],t=e.length;for(let i=1;i<n.length;i++){let s=n[i][0];if(s.length!=t)return!1;if(s!=e){for(let r=0;r<t;r++)if(s[r]!=e[r])return!1}}return!0}function kP(n,e=100){let t=n.length;if(t<=1)return!0;let i=0,s=t-1;for(;i<=s&&n[i]==null;)i++;for(;s>=i&&n[s]==null;)s--;if(s<=i)return!0;let r=Ni(1,Ki((s-i+1)/e));for(let o=n[i],a=i+r;a<=s;a+=r){let l=n[a];if(l!=null){if(l<=o)return!1;o=l}}return!0}var rS=["January","February","March","April","May","June","July","August","September","October","November","December"],oS=["Sunday","Monday","Tuesday","Wednesday","Thursday","Friday","Saturday"];function aS(n){return n.slice(0,3)}var zP=oS.map(aS),VP=rS.map(aS),HP={MMMM:rS,MMM:VP,WWWW:oS,WWW:zP};function pu(n){return(n<10?"0":"")+n}function $P(n){return(n<10?"00":n<100?"0":"")+n}var GP={YYYY:n=>n.getFullYear(),YY:n=>(n.getFullYear()+"").slice(2),MMMM:(n,e)=>e.MMMM[n.getMonth()],MMM:(n,e)=>e.MMM[n.getMonth()],MM:n=>pu(n.getMonth()+1),M:n=>n.getMonth()+1,DD:n=>pu(n.getDate()),D:n=>n.getDate(),WWWW:(n,e)=>e.WWWW[n.getDay()],WWW:(n,e)=>e.WWW[n.getDay()],HH:n=>pu(n.getHours()),H:n=>n.getHours(),h:n=>{let e=n.getHours();return e==0?12:e>12?e-12:e},AA:n=>n.getHours()>=12?"PM":"AM",aa:n=>n.getHours()>=12?"pm":"am",a:n=>n.getHours()>=12?"p":"a",mm:n=>pu(n.getMinutes()),m:n=>n.getMinutes(),ss:n=>pu(n.getSeconds()),s:n=>n.getSeconds(),fff:n=>$P(n.getMilliseconds())};function Wg(n,e){e=e||HP;let t=[],i=/\{([a-z]+)\}|[^{]+/gi,s;for(;s=i.exec(n);)t.push(s[0][0]=="{"?GP[s[1]]:s[0]);return r=>{let o="";for(let a=0;a<t.length;a++)o+=typeof t[a]=="string"?t[a]:t[a](r,e);return o}}var WP=new Intl.DateTimeFormat().resolvedOptions().timeZone;function XP(n,e){let t;return e=="UTC"||e=="Etc/UTC"?t=new Date(+n+n.getTimezoneOffset()*6e4):e==WP?t=n:(t=new Date(n.toLocaleString("en-US",{timeZone:e})),t.setMilliseconds(n.getMilliseconds())),t}var lS=n=>n%1==0,Ff=[1,2,2.5,5],qP=xu(10,-32,0,Ff),cS=xu(10,0,32,Ff),YP=cS.filter(lS),la=qP.concat(cS),Xg=`
`,uS="{YYYY}",Cb=Xg+uS,hS="{M}/{D}",_u=Xg+hS,Lf=_u+"/{YY}",dS="{aa}",jP="{h}:{mm}",Rl=jP+dS,Rb=Xg+Rl,Pb=":{ss}",Dt=null;function fS(n){let e=n*1e3,t=e*60,i=t*60,s=i*24,r=s*30,o=s*365,l=(n==1?xu(10,0,3,Ff).filter(lS):xu(10,-3,0,Ff)).concat([e,e*5,e*10,e*15,e*30,t,t*5,t*10,t*15,t*30,i,i*2,i*3,i*4,i*6,i*8,i*12,s,s*2,s*3,s*4,s*5,s*6,s*7,s*8,s*9,s*10,s*15,r,r*2,r*3,r*4,r*6,o,o*2,o*5,o*10,o*25,o*50,o*100]),c=[[o,uS,Dt,Dt,Dt,Dt,Dt,Dt,1],[s*28,"{MMM}",Cb,Dt,Dt,Dt,Dt,Dt,1],[s,hS,Cb,Dt,Dt,Dt,Dt,Dt,1],[i,"{h}"+dS,Lf,Dt,_u,Dt,Dt,Dt,1],[t,Rl,Lf,Dt,_u,Dt,Dt,Dt,1],[e,Pb,Lf+" "+Rl,Dt,_u+" "+Rl,Dt,Rb,Dt,1],[n,Pb+".{fff}",Lf+" "+Rl,Dt,_u+" "+Rl,Dt,Rb,Dt,1]];function u(h){return(d,f,m,y,g,p)=>{let x=[],T=g>=o,b=g>=r&&g<o,R=h(m),A=Xt(R*n,3),v=Eg(R.getFullYear(),T?0:R.getMonth(),b||T?1:R.getDate()),E=Xt(v*n,3);if(b||T){let k=b?g/r:0,U=T?g/o:0,I=A==E?A:Xt(Eg(v.getFullYear()+U,v.getMonth()+k,1)*n,3),z=new Date(Vn(I/n)),H=z.getFullYear(),N=z.getMonth();for(let G=0;I<=y;G++){let Y=Eg(H+U*G,N+k*G,1),W=Y-h(Xt(Y*n,3));I=Xt((+Y+W)*n,3),I<=y&&x.push(I)}}else{let k=g>=s?s:g,U=Ki(m)-Ki(A),I=E+U+zf(A-E,k);x.push(I);let z=h(I),H=z.getHours()+z.getMinutes()/t+z.getSeconds()/i,N=g/i,G=d.axes[f]._space,Y=p/G;for(;I=Xt(I+g,n==1?0:3),!(I>y);)if(N>1){let W=Ki(Xt(H+N,6))%24,Q=h(I).getHours()-W;Q>1&&(Q=-1),I-=Q*i,H=(H+N)%24;let se=x[x.length-1];Xt((I-se)/g,3)*Y>=.7&&x.push(I)}else x.push(I)}return x}}return[l,c,u]}var[ZP,JP,KP]=fS(1),[QP,e3,t3]=fS(.001);xu(2,-53,53,[1]);function Ib(n,e){return n.map(t=>t.map((i,s)=>s==0||s==8||i==null?i:e(s==1||t[8]==0?i:t[1]+i)))}function Lb(n,e){return(t,i,s,r,o)=>{let a=e.find(m=>o>=m[0])||e[e.length-1],l,c,u,h,d,f;return i.map(m=>{let y=n(m),g=y.getFullYear(),p=y.getMonth(),x=y.getDate(),T=y.getHours(),b=y.getMinutes(),R=y.getSeconds(),A=g!=l&&a[2]||p!=c&&a[3]||x!=u&&a[4]||T!=h&&a[5]||b!=d&&a[6]||R!=f&&a[7]||a[1];return l=g,c=p,u=x,h=T,d=b,f=R,A(y)})}}function n3(n,e){let t=Wg(e);return(i,s,r,o,a)=>s.map(l=>t(n(l)))}function Eg(n,e,t){return new Date(n,e,t)}function Db(n,e){return e(n)}var i3="{YYYY}-{MM}-{DD} {h}:{mm}{aa}";function Nb(n,e){return(t,i,s,r)=>r==null?kg:e(n(i))}function s3(n,e){let t=n.series[e];return t.width?t.stroke(n,e):t.points.width?t.points.stroke(n,e):null}function r3(n,e){return n.series[e].fill(n,e)}var o3={show:!0,live:!0,isolate:!1,mount:EP,markers:{show:!0,width:2,stroke:s3,fill:r3,dash:"solid"},idx:null,idxs:null,values:[]};function a3(n,e){let t=n.cursor.points,i=fs(),s=t.size(n,e);tn(i,mu,s),tn(i,gu,s);let r=s/-2;tn(i,"marginLeft",r),tn(i,"marginTop",r);let o=t.width(n,e,s);return o&&tn(i,"borderWidth",o),i}function l3(n,e){let t=n.series[e].points;return t._fill||t._stroke}function c3(n,e){let t=n.series[e].points;return t._stroke||t._fill}function u3(n,e){return n.series[e].points.size}var Tg=[0,0];function h3(n,e,t){return Tg[0]=e,Tg[1]=t,Tg}function Df(n,e,t,i=!0){return s=>{s.button==0&&(!i||s.target==e)&&t(s)}}function Ag(n,e,t,i=!0){return s=>{(!i||s.target==e)&&t(s)}}var d3={show:!0,x:!0,y:!0,lock:!1,move:h3,points:{one:!1,show:a3,size:u3,width:0,stroke:c3,fill:l3},bind:{mousedown:Df,mouseup:Df,click:Df,dblclick:Df,mousemove:Ag,mouseleave:Ag,mouseenter:Ag},drag:{setScale:!0,x:!0,y:!1,dist:0,uni:null,click:(n,e)=>{e.stopPropagation(),e.stopImmediatePropagation()},_x:!1,_y:!1},focus:{dist:(n,e,t,i,s)=>i-s,prox:-1,bias:0},hover:{skip:[void 0],prox:null,bias:0},left:-10,top:-10,idx:null,dataIdx:null,idxs:null,event:null},pS={show:!0,stroke:"rgba(0,0,0,0.07)",width:2},qg=Ln({},pS,{filter:eS}),mS=Ln({},qg,{size:10}),gS=Ln({},pS,{show:!1}),Yg='12px system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial, "Noto Sans", sans-serif, "Apple Color Emoji", "Segoe UI Emoji", "Segoe UI Symbol", "Noto Color Emoji"',_S="bold "+Yg,vS=1.5,Ub={show:!0,scale:"x",stroke:Bg,space:50,gap:5,alignTo:1,size:50,labelGap:0,labelSize:30,labelFont:_S,side:2,grid:qg,ticks:mS,border:gS,font:Yg,lineGap:vS,rotate:0},f3="Value",p3="Time",Ob={show:!0,scale:"x",auto:!1,sorted:1,min:Wt,max:-Wt,idxs:[]};function m3(n,e,t,i,s){return e.map(r=>r==null?"":$g(r))}function g3(n,e,t,i,s,r,o){let a=[],l=xo.get(s)||0;t=o?t:Xt(zf(t,s),l);for(let c=t;c<=i;c=Xt(c+s,l))a.push(Object.is(c,-0)?0:c);return a}function Dg(n,e,t,i,s,r,o){let a=[],l=n.scales[n.axes[e].scale].log,c=l==10?Dr:Jb,u=Ki(c(t));s=Il(l,u),l==10&&(s=la[Is(s,la)]);let h=t,d=s*l;l==10&&(d=la[Is(d,la)]);do a.push(h),h=h+s,l==10&&!xo.has(h)&&(h=Xt(h,xo.get(s))),h>=d&&(s=h,d=s*l,l==10&&(d=la[Is(d,la)]));while(h<=i);return a}function _3(n,e,t,i,s,r,o){let l=n.scales[n.axes[e].scale].asinh,c=i>l?Dg(n,e,Ni(l,t),i,s):[l],u=i>=0&&t<=0?[0]:[];return(t<-l?Dg(n,e,Ni(l,-i),-t,s):[l]).reverse().map(d=>-d).concat(u,c)}var yS=/./,v3=/[12357]/,y3=/[125]/,Fb=/1/,Ng=(n,e,t,i)=>n.map((s,r)=>e==4&&s==0||r%i==0&&t.test(s.toExponential()[s<0?1:0])?s:null);function x3(n,e,t,i,s){let r=n.axes[t],o=r.scale,a=n.scales[o],l=n.valToPos,c=r._space,u=l(10,o),h=l(9,o)-u>=c?yS:l(7,o)-u>=c?v3:l(5,o)-u>=c?y3:Fb;if(h==Fb){let d=Hn(l(1,o)-u);if(d<c)return Ng(e.slice().reverse(),a.distr,h,ps(c/d)).reverse()}return Ng(e,a.distr,h,1)}function b3(n,e,t,i,s){let r=n.axes[t],o=r.scale,a=r._space,l=n.valToPos,c=Hn(l(1,o)-l(2,o));return c<a?Ng(e.slice().reverse(),3,yS,ps(a/c)).reverse():e}function S3(n,e,t,i){return i==null?kg:e==null?"":$g(e)}var Bb={show:!0,scale:"y",stroke:Bg,space:30,gap:5,alignTo:1,size:50,labelGap:0,labelSize:30,labelFont:_S,side:3,grid:qg,ticks:mS,border:gS,font:Yg,lineGap:vS,rotate:0};function M3(n,e){let t=3+(n||1)*2;return Xt(t*e,3)}function w3(n,e){let{scale:t,idxs:i}=n.series[0],s=n._data[0],r=n.valToPos(s[i[0]],t,!0),o=n.valToPos(s[i[1]],t,!0),a=Hn(o-r),l=n.series[e],c=a/(l.points.space*Ct);return i[1]-i[0]<=c}var kb={scale:null,auto:!0,sorted:0,min:Wt,max:-Wt},xS=(n,e,t,i,s)=>s,zb={show:!0,auto:!0,sorted:0,gaps:xS,alpha:1,facets:[Ln({},kb,{scale:"x"}),Ln({},kb,{scale:"y"})]},Vb={scale:"y",auto:!0,sorted:0,show:!0,spanGaps:!1,gaps:xS,alpha:1,points:{show:w3,filter:null},values:null,min:Wt,max:-Wt,idxs:[],path:null,clip:null};function E3(n,e,t,i,s){return t/10}var bS={time:!0,auto:!0,distr:1,log:10,asinh:1,min:null,max:null,dir:1,ori:0},T3=Ln({},bS,{time:!1,ori:1}),Hb={};function SS(n,e){let t=Hb[n];return t||(t={key:n,plots:[],sub(i){t.plots.push(i)},unsub(i){t.plots=t.plots.filter(s=>s!=i)},pub(i,s,r,o,a,l,c){for(let u=0;u<t.plots.length;u++)t.plots[u]!=s&&t.plots[u].pub(i,s,r,o,a,l,c)}},n!=null&&(Hb[n]=t)),t}var Nl=1,Ug=2;function da(n,e,t){let i=n.mode,s=n.series[e],r=i==2?n._data[e]:n._data,o=n.scales,a=n.bbox,l=r[0],c=i==2?r[1]:r[e],u=i==2?o[s.facets[0].scale]:o[n.series[0].scale],h=i==2?o[s.facets[1].scale]:o[s.scale],d=a.left,f=a.top,m=a.width,y=a.height,g=n.valToPosH,p=n.valToPosV;return u.ori==0?t(s,l,c,u,h,g,p,d,f,m,y,$f,Ol,Wf,wS,TS):t(s,l,c,u,h,p,g,f,d,y,m,Gf,Fl,Jg,ES,AS)}function jg(n,e){let t=0,i=0,s=Tt(n.bands,Gg);for(let r=0;r<s.length;r++){let o=s[r];o.series[0]==e?t=o.dir:o.series[1]==e&&(o.dir==1?i|=1:i|=2)}return[t,i==1?-1:i==2?1:i==3?2:0]}function A3(n,e,t,i,s){let r=n.mode,o=n.series[e],a=r==2?o.facets[1].scale:o.scale,l=n.scales[a];return s==-1?l.min:s==1?l.max:l.distr==3?l.dir==1?l.min:l.max:0}function Nr(n,e,t,i,s,r){return da(n,e,(o,a,l,c,u,h,d,f,m,y,g)=>{let p=o.pxRound,x=c.dir*(c.ori==0?1:-1),T=c.ori==0?Ol:Fl,b,R;x==1?(b=t,R=i):(b=i,R=t);let A=p(h(a[b],c,y,f)),v=p(d(l[b],u,g,m)),E=p(h(a[R],c,y,f)),k=p(d(r==1?u.max:u.min,u,g,m)),U=new Path2D(s);return T(U,E,k),T(U,A,k),T(U,A,v),U})}function Hf(n,e,t,i,s,r){let o=null;if(n.length>0){o=new Path2D;let a=e==0?Wf:Jg,l=t;for(let h=0;h<n.length;h++){let d=n[h];if(d[1]>d[0]){let f=d[0]-l;f>0&&a(o,l,i,f,i+r),l=d[1]}}let c=t+s-l,u=10;c>0&&a(o,l,i-u/2,c,i+r+u)}return o}function C3(n,e,t){let i=n[n.length-1];i&&i[0]==e?i[1]=t:n.push([e,t])}function Zg(n,e,t,i,s,r,o){let a=[],l=n.length;for(let c=s==1?t:i;c>=t&&c<=i;c+=s)if(e[c]===null){let h=c,d=c;if(s==1)for(;++c<=i&&e[c]===null;)d=c;else for(;--c>=t&&e[c]===null;)d=c;let f=r(n[h]),m=d==h?f:r(n[d]),y=h-s;f=o<=0&&y>=0&&y<l?r(n[y]):f;let p=d+s;m=o>=0&&p>=0&&p<l?r(n[p]):m,m>=f&&a.push([f,m])}return a}function $b(n){return n==0?Qb:n==1?Vn:e=>aa(e,n)}function MS(n){let e=n==0?$f:Gf,t=n==0?(s,r,o,a,l,c)=>{s.arcTo(r,o,a,l,c)}:(s,r,o,a,l,c)=>{s.arcTo(o,r,l,a,c)},i=n==0?(s,r,o,a,l)=>{s.rect(r,o,a,l)}:(s,r,o,a,l)=>{s.rect(o,r,l,a)};return(s,r,o,a,l,c=0,u=0)=>{c==0&&u==0?i(s,r,o,a,l):(c=Ls(c,a/2,l/2),u=Ls(u,a/2,l/2),e(s,r+c,o),t(s,r+a,o,r+a,o+l,c),t(s,r+a,o+l,r,o+l,u),t(s,r,o+l,r,o,u),t(s,r,o,r+a,o,c),s.closePath())}}var $f=(n,e,t)=>{n.moveTo(e,t)},Gf=(n,e,t)=>{n.moveTo(t,e)},Ol=(n,e,t)=>{n.lineTo(e,t)},Fl=(n,e,t)=>{n.lineTo(t,e)},Wf=MS(0),Jg=MS(1),wS=(n,e,t,i,s,r)=>{n.arc(e,t,i,s,r)},ES=(n,e,t,i,s,r)=>{n.arc(t,e,i,s,r)},TS=(n,e,t,i,s,r,o)=>{n.bezierCurveTo(e,t,i,s,r,o)},AS=(n,e,t,i,s,r,o)=>{n.bezierCurveTo(t,e,s,i,o,r)};function CS(n){return(e,t,i,s,r)=>da(e,t,(o,a,l,c,u,h,d,f,m,y,g)=>{let{pxRound:p,points:x}=o,T,b;c.ori==0?(T=$f,b=wS):(T=Gf,b=ES);let R=Xt(x.width*Ct,3),A=(x.size-x.width)/2*Ct,v=Xt(A*2,3),E=new Path2D,k=new Path2D,{left:U,top:I,width:z,height:H}=e.bbox;Wf(k,U-v,I-v,z+v*2,H+v*2);let N=G=>{if(l[G]!=null){let Y=p(h(a[G],c,y,f)),W=p(d(l[G],u,g,m));T(E,Y+A,W),b(E,Y,W,A,0,Nf*2)}};if(r)r.forEach(N);else for(let G=i;G<=s;G++)N(G);return{stroke:R>0?E:null,fill:E,clip:k,flags:Nl|Ug}})}function RS(n){return(e,t,i,s,r,o)=>{i!=s&&(r!=i&&o!=i&&n(e,t,i),r!=s&&o!=s&&n(e,t,s),n(e,t,o))}}var R3=RS(Ol),P3=RS(Fl);function PS(n){let e=Tt(n?.alignGaps,0);return(t,i,s,r)=>da(t,i,(o,a,l,c,u,h,d,f,m,y,g)=>{[s,r]=Bf(l,s,r);let p=o.pxRound,x=H=>p(h(H,c,y,f)),T=H=>p(d(H,u,g,m)),b,R;c.ori==0?(b=Ol,R=R3):(b=Fl,R=P3);let A=c.dir*(c.ori==0?1:-1),v={stroke:new Path2D,fill:null,clip:null,band:null,gaps:null,flags:Nl},E=v.stroke,k=!1;if(r-s>=y*4){let H=he=>t.posToVal(he,c.key,!0),N=null,G=null,Y,W,ce,J=x(a[A==1?s:r]),Q=x(a[s]),se=x(a[r]),de=H(A==1?Q+1:se-1);for(let he=A==1?s:r;he>=s&&he<=r;he+=A){let ee=a[he],ye=(A==1?ee<de:ee>de)?J:x(ee),Ce=l[he];ye==J?Ce!=null?(W=Ce,N==null?(b(E,ye,T(W)),Y=N=G=W):W<N?N=W:W>G&&(G=W)):Ce===null&&(k=!0):(N!=null&&R(E,J,T(N),T(G),T(Y),T(W)),Ce!=null?(W=Ce,b(E,ye,T(W)),N=G=Y=W):(N=G=null,Ce===null&&(k=!0)),J=ye,de=H(J+A))}N!=null&&N!=G&&ce!=J&&R(E,J,T(N),T(G),T(Y),T(W))}else for(let H=A==1?s:r;H>=s&&H<=r;H+=A){let N=l[H];N===null?k=!0:N!=null&&b(E,x(a[H]),T(N))}let[I,z]=jg(t,i);if(o.fill!=null||I!=0){let H=v.fill=new Path2D(E),N=o.fillTo(t,i,o.min,o.max,I),G=T(N),Y=x(a[s]),W=x(a[r]);A==-1&&([W,Y]=[Y,W]),b(H,W,G),b(H,Y,G)}if(!o.spanGaps){let H=[];k&&H.push(...Zg(a,l,s,r,A,x,e)),v.gaps=H=o.gaps(t,i,s,r,H),v.clip=Hf(H,c.ori,f,m,y,g)}return z!=0&&(v.band=z==2?[Nr(t,i,s,r,E,-1),Nr(t,i,s,r,E,1)]:Nr(t,i,s,r,E,z)),v})}function I3(n){let e=Tt(n.align,1),t=Tt(n.ascDesc,!1),i=Tt(n.alignGaps,0),s=Tt(n.extend,!1);return(r,o,a,l)=>da(r,o,(c,u,h,d,f,m,y,g,p,x,T)=>{[a,l]=Bf(h,a,l);let b=c.pxRound,{left:R,width:A}=r.bbox,v=Q=>b(m(Q,d,x,g)),E=Q=>b(y(Q,f,T,p)),k=d.ori==0?Ol:Fl,U={stroke:new Path2D,fill:null,clip:null,band:null,gaps:null,flags:Nl},I=U.stroke,z=d.dir*(d.ori==0?1:-1),H=E(h[z==1?a:l]),N=v(u[z==1?a:l]),G=N,Y=N;s&&e==-1&&(Y=R,k(I,Y,H)),k(I,N,H);for(let Q=z==1?a:l;Q>=a&&Q<=l;Q+=z){let se=h[Q];if(se==null)continue;let de=v(u[Q]),he=E(se);e==1?k(I,de,H):k(I,G,he),k(I,de,he),H=he,G=de}let W=G;s&&e==1&&(W=R+A,k(I,W,H));let[ce,J]=jg(r,o);if(c.fill!=null||ce!=0){let Q=U.fill=new Path2D(I),se=c.fillTo(r,o,c.min,c.max,ce),de=E(se);k(Q,W,de),k(Q,Y,de)}if(!c.spanGaps){let Q=[];Q.push(...Zg(u,h,a,l,z,v,i));let se=c.width*Ct/2,de=t||e==1?se:-se,he=t||e==-1?-se:se;Q.forEach(ee=>{ee[0]+=de,ee[1]+=he}),U.gaps=Q=c.gaps(r,o,a,l,Q),U.clip=Hf(Q,d.ori,g,p,x,T)}return J!=0&&(U.band=J==2?[Nr(r,o,a,l,I,-1),Nr(r,o,a,l,I,1)]:Nr(r,o,a,l,I,J)),U})}function Gb(n,e,t,i,s,r,o=Wt){if(n.length>1){let a=null;for(let l=0,c=1/0;l<n.length;l++)if(e[l]!==void 0){if(a!=null){let u=Hn(n[l]-n[a]);u<c&&(c=u,o=Hn(t(n[l],i,s,r)-t(n[a],i,s,r)))}a=l}}return o}function L3(n){n=n||yu;let e=Tt(n.size,[.6,Wt,1]),t=n.align||0,i=n.gap||0,s=n.radius;s=s==null?[0,0]:typeof s=="number"?[s,0]:s;let r=St(s),o=1-e[0],a=Tt(e[1],Wt),l=Tt(e[2],1),c=Tt(n.disp,yu),u=Tt(n.each,f=>{}),{fill:h,stroke:d}=c;return(f,m,y,g)=>da(f,m,(p,x,T,b,R,A,v,E,k,U,I)=>{let z=p.pxRound,H=t,N=i*Ct,G=a*Ct,Y=l*Ct,W,ce;b.ori==0?[W,ce]=r(f,m):[ce,W]=r(f,m);let J=b.dir*(b.ori==0?1:-1),Q=b.ori==0?Wf:Jg,se=b.ori==0?u:(Pe,Ye,ot,we,Ht,He,qe)=>{u(Pe,Ye,ot,Ht,we,qe,He)},de=Tt(f.bands,Gg).find(Pe=>Pe.series[0]==m),he=de!=null?de.dir:0,ee=p.fillTo(f,m,p.min,p.max,he),ge=z(v(ee,R,I,k)),ye,Ce,Me,We=U,rt=z(p.width*Ct),$e=!1,mt=null,dt=null,it=null,nn=null;h!=null&&(rt==0||d!=null)&&($e=!0,mt=h.values(f,m,y,g),dt=new Map,new Set(mt).forEach(Pe=>{Pe!=null&&dt.set(Pe,new Path2D)}),rt>0&&(it=d.values(f,m,y,g),nn=new Map,new Set(it).forEach(Pe=>{Pe!=null&&nn.set(Pe,new Path2D)})));let{x0:qt,size:bn}=c;if(qt!=null&&bn!=null){H=1,x=qt.values(f,m,y,g),qt.unit==2&&(x=x.map(ot=>f.posToVal(E+ot*U,b.key,!0)));let Pe=bn.values(f,m,y,g);bn.unit==2?Ce=Pe[0]*U:Ce=A(Pe[0],b,U,E)-A(0,b,U,E),We=Gb(x,T,A,b,U,E,We),Me=We-Ce+N}else We=Gb(x,T,A,b,U,E,We),Me=We*o+N,Ce=We-Me;Me<1&&(Me=0),rt>=Ce/2&&(rt=0),Me<5&&(z=Qb);let Bt=Me>0,Gn=We-Me-(Bt?rt:0);Ce=z(Lg(Gn,Y,G)),ye=(H==0?Ce/2:H==J?0:Ce)-H*J*((H==0?N/2:0)+(Bt?rt/2:0));let Mt={stroke:null,fill:null,clip:null,band:null,gaps:null,flags:0},Nn=$e?null:new Path2D,ln=null;if(de!=null)ln=f.data[de.series[1]];else{let{y0:Pe,y1:Ye}=c;Pe!=null&&Ye!=null&&(T=Ye.values(f,m,y,g),ln=Pe.values(f,m,y,g))}let Sn=W*Ce,F=ce*Ce;for(let Pe=J==1?y:g;Pe>=y&&Pe<=g;Pe+=J){let Ye=T[Pe];if(Ye==null)continue;if(ln!=null){let X=ln[Pe]??0;if(Ye-X==0)continue;ge=v(X,R,I,k)}let ot=b.distr!=2||c!=null?x[Pe]:Pe,we=A(ot,b,U,E),Ht=v(Tt(Ye,ee),R,I,k),He=z(we-ye),qe=z(Ni(Ht,ge)),C=z(Ls(Ht,ge)),S=qe-C;if(Ye!=null){let X=Ye<0?F:Sn,ue=Ye<0?Sn:F;$e?(rt>0&&it[Pe]!=null&&Q(nn.get(it[Pe]),He,C+Ki(rt/2),Ce,Ni(0,S-rt),X,ue),mt[Pe]!=null&&Q(dt.get(mt[Pe]),He,C+Ki(rt/2),Ce,Ni(0,S-rt),X,ue)):Q(Nn,He,C+Ki(rt/2),Ce,Ni(0,S-rt),X,ue),se(f,m,Pe,He-rt/2,C,Ce+rt,S)}}return rt>0?Mt.stroke=$e?nn:Nn:$e||(Mt._fill=p.width==0?p._fill:p._stroke??p._fill,Mt.width=0),Mt.fill=$e?dt:Nn,Mt})}function D3(n,e){let t=Tt(e?.alignGaps,0);return(i,s,r,o)=>da(i,s,(a,l,c,u,h,d,f,m,y,g,p)=>{[r,o]=Bf(c,r,o);let x=a.pxRound,T=W=>x(d(W,u,g,m)),b=W=>x(f(W,h,p,y)),R,A,v;u.ori==0?(R=$f,v=Ol,A=TS):(R=Gf,v=Fl,A=AS);let E=u.dir*(u.ori==0?1:-1),k=T(l[E==1?r:o]),U=k,I=[],z=[];for(let W=E==1?r:o;W>=r&&W<=o;W+=E)if(c[W]!=null){let J=l[W],Q=T(J);I.push(U=Q),z.push(b(c[W]))}let H={stroke:n(I,z,R,v,A,x),fill:null,clip:null,band:null,gaps:null,flags:Nl},N=H.stroke,[G,Y]=jg(i,s);if(a.fill!=null||G!=0){let W=H.fill=new Path2D(N),ce=a.fillTo(i,s,a.min,a.max,G),J=b(ce);v(W,U,J),v(W,k,J)}if(!a.spanGaps){let W=[];W.push(...Zg(l,c,r,o,E,T,t)),H.gaps=W=a.gaps(i,s,r,o,W),H.clip=Hf(W,u.ori,m,y,g,p)}return Y!=0&&(H.band=Y==2?[Nr(i,s,r,o,N,-1),Nr(i,s,r,o,N,1)]:Nr(i,s,r,o,N,Y)),H})}function N3(n){return D3(U3,n)}function U3(n,e,t,i,s,r){let o=n.length;if(o<2)return null;let a=new Path2D;if(t(a,n[0],e[0]),o==2)i(a,n[1],e[1]);else{let l=Array(o),c=Array(o-1),u=Array(o-1),h=Array(o-1);for(let d=0;d<o-1;d++)u[d]=e[d+1]-e[d],h[d]=n[d+1]-n[d],c[d]=u[d]/h[d];l[0]=c[0];for(let d=1;d<o-1;d++)c[d]===0||c[d-1]===0||c[d-1]>0!=c[d]>0?l[d]=0:(l[d]=3*(h[d-1]+h[d])/((2*h[d]+h[d-1])/c[d-1]+(h[d]+2*h[d-1])/c[d]),isFinite(l[d])||(l[d]=0));l[o-1]=c[o-2];for(let d=0;d<o-1;d++)s(a,n[d]+h[d]/3,e[d]+l[d]*h[d]/3,n[d+1]-h[d]/3,e[d+1]-l[d+1]*h[d]/3,n[d+1],e[d+1])}return a}var Og=new Set;function Wb(){for(let n of Og)n.syncRect(!0)}Ul&&(ua(mP,Pl,Wb),ua(gP,Pl,Wb,!0),ua(Uf,Pl,()=>{$n.pxRatio=Ct}));var O3=PS(),F3=CS();function Xb(n,e,t,i){return(i?[n[0],n[1]].concat(n.slice(2)):[n[0]].concat(n.slice(1))).map((r,o)=>Fg(r,o,e,t))}function B3(n,e){return n.map((t,i)=>i==0?{}:Ln({},e,t))}function Fg(n,e,t,i){return Ln({},e==0?t:i,n)}function IS(n,e,t){return e==null?Ll:[e,t]}var k3=IS;function z3(n,e,t){return e==null?Ll:Of(e,t,Hg,!0)}function LS(n,e,t,i){return e==null?Ll:kf(e,t,n.scales[i].log,!1)}var V3=LS;function DS(n,e,t,i){return e==null?Ll:Vg(e,t,n.scales[i].log,!1)}var H3=DS;function $3(n,e,t,i,s){let r=Ni(wb(n),wb(e)),o=e-n,a=Is(s/i*o,t);do{let l=t[a],c=i*l/o;if(c>=s&&r+(l<5?xo.get(l):0)<=17)return[l,c]}while(++a<t.length);return[0,0]}function qb(n){let e,t;return n=n.replace(/(\d+)px/,(i,s)=>(e=Vn((t=+s)*Ct))+"px"),[n,e,t]}function G3(n){n.show&&[n.font,n.labelFont].forEach(e=>{let t=Xt(e[2]*Ct,1);e[0]=e[0].replace(/[0-9.]+px/,t+"px"),e[1]=t})}function $n(n,e,t){let i={mode:Tt(n.mode,1)},s=i.mode;function r(_,M,P,L){let $=M.valToPct(_);return L+P*(M.dir==-1?1-$:$)}function o(_,M,P,L){let $=M.valToPct(_);return L+P*(M.dir==-1?$:1-$)}function a(_,M,P,L){return M.ori==0?r(_,M,P,L):o(_,M,P,L)}i.valToPosH=r,i.valToPosV=o;let l=!1;i.status=0;let c=i.root=fs(J2);if(n.id!=null&&(c.id=n.id),Ji(c,n.class),n.title){let _=fs(eP,c);_.textContent=n.title}let u=Ps("canvas"),h=i.ctx=u.getContext("2d"),d=fs(tP,c);ua("click",d,_=>{_.target===m&&(Zt!=xa||sn!=ba)&&Qn.click(i,_)},!0);let f=i.under=fs(nP,d);d.appendChild(u);let m=i.over=fs(iP,d);n=Dl(n);let y=+Tt(n.pxAlign,1),g=$b(y);(n.plugins||[]).forEach(_=>{_.opts&&(n=_.opts(i,n)||n)});let p=n.ms||.001,x=i.series=s==1?Xb(n.series||[],Ob,Vb,!1):B3(n.series||[null],zb),T=i.axes=Xb(n.axes||[],Ub,Bb,!0),b=i.scales={},R=i.bands=n.bands||[];R.forEach(_=>{_.fill=St(_.fill||null),_.dir=Tt(_.dir,-1)});let A=s==2?x[1].facets[0].scale:x[0].scale,v={axes:lr,series:_t},E=(n.drawOrder||["axes","series"]).map(_=>v[_]);function k(_){let M=_.distr==3?P=>Dr(P>0?P:_.clamp(i,P,_.min,_.max,_.key)):_.distr==4?P=>wg(P,_.asinh):_.distr==100?P=>_.fwd(P):P=>P;return P=>{let L=M(P),{_min:$,_max:Z}=_,ae=Z-$;return(L-$)/ae}}function U(_){let M=b[_];if(M==null){let P=(n.scales||yu)[_]||yu;if(P.from!=null){U(P.from);let L=Ln({},b[P.from],P,{key:_});L.valToPct=k(L),b[_]=L}else{M=b[_]=Ln({},_==A?bS:T3,P),M.key=_;let L=M.time,$=M.range,Z=yo($);if((_!=A||s==2&&!L)&&(Z&&($[0]==null||$[1]==null)&&($={min:$[0]==null?bb:{mode:1,hard:$[0],soft:$[0]},max:$[1]==null?bb:{mode:1,hard:$[1],soft:$[1]}},Z=!1),!Z&&Vf($))){let ae=$;$=(fe,be,Ne)=>be==null?Ll:Of(be,Ne,ae)}M.range=St($||(L?k3:_==A?M.distr==3?V3:M.distr==4?H3:IS:M.distr==3?LS:M.distr==4?DS:z3)),M.auto=St(Z?!1:M.auto),M.clamp=St(M.clamp||E3),M._min=M._max=null,M.valToPct=k(M)}}}U("x"),U("y"),s==1&&x.forEach(_=>{U(_.scale)}),T.forEach(_=>{U(_.scale)});for(let _ in n.scales)U(_);let I=b[A],z=I.distr,H,N;I.ori==0?(Ji(c,K2),H=r,N=o):(Ji(c,Q2),H=o,N=r);let G={};for(let _ in b){let M=b[_];(M.min!=null||M.max!=null)&&(G[_]={min:M.min,max:M.max},M.min=M.max=null)}let Y=n.tzDate||(_=>new Date(Vn(_/p))),W=n.fmtDate||Wg,ce=p==1?KP(Y):t3(Y),J=Lb(Y,Ib(p==1?JP:e3,W)),Q=Nb(Y,Db(i3,W)),se=[],de=i.legend=Ln({},o3,n.legend),he=i.cursor=Ln({},d3,{drag:{y:s==2}},n.cursor),ee=de.show,ge=he.show,ye=de.markers;de.idxs=se,ye.width=St(ye.width),ye.dash=St(ye.dash),ye.stroke=St(ye.stroke),ye.fill=St(ye.fill);let Ce,Me,We,rt=[],$e=[],mt,dt=!1,it={};if(de.live){let _=x[1]?x[1].values:null;dt=_!=null,mt=dt?_(i,1,0):{_:0};for(let M in mt)it[M]=kg}if(ee)if(Ce=Ps("table",cP,c),We=Ps("tbody",null,Ce),de.mount(i,Ce),dt){Me=Ps("thead",null,Ce,We);let _=Ps("tr",null,Me);Ps("th",null,_);for(var nn in mt)Ps("th",lb,_).textContent=nn}else Ji(Ce,hP),de.live&&Ji(Ce,uP);let qt={show:!0},bn={show:!1};function Bt(_,M){if(M==0&&(dt||!de.live||s==2))return Ll;let P=[],L=Ps("tr",dP,We,We.childNodes[M]);Ji(L,_.class),_.show||Ji(L,ca);let $=Ps("th",null,L);if(ye.show){let fe=fs(fP,$);if(M>0){let be=ye.width(i,M);be&&(fe.style.border=be+"px "+ye.dash(i,M)+" "+ye.stroke(i,M)),fe.style.background=ye.fill(i,M)}}let Z=fs(lb,$);_.label instanceof HTMLElement?Z.appendChild(_.label):Z.textContent=_.label,M>0&&(ye.show||(Z.style.color=_.width>0?ye.stroke(i,M):ye.fill(i,M)),Mt("click",$,fe=>{if(he._lock)return;Ke(fe);let be=x.indexOf(_);if((fe.ctrlKey||fe.metaKey)!=de.isolate){let Ne=x.some((Oe,Be)=>Be>0&&Be!=be&&Oe.show);x.forEach((Oe,Be)=>{Be>0&&Os(Be,Ne?Be==be?qt:bn:qt,!0,Tn.setSeries)})}else Os(be,{show:!_.show},!0,Tn.setSeries)},!1),Qe&&Mt(db,$,fe=>{he._lock||(Ke(fe),Os(x.indexOf(_),Ma,!0,Tn.setSeries))},!1));for(var ae in mt){let fe=Ps("td",pP,L);fe.textContent="--",P.push(fe)}return[L,P]}let Gn=new Map;function Mt(_,M,P,L=!0){let $=Gn.get(M)||{},Z=he.bind[_](i,M,P,L);Z&&(ua(_,M,$[_]=Z),Gn.set(M,$))}function Nn(_,M,P){let L=Gn.get(M)||{};for(let $ in L)(_==null||$==_)&&(Ig($,M,L[$]),delete L[$]);_==null&&Gn.delete(M)}let ln=0,Sn=0,F=0,Pe=0,Ye=0,ot=0,we=Ye,Ht=ot,He=F,qe=Pe,C=0,S=0,X=0,ue=0;i.bbox={};let oe=!1,ve=!1,xe=!1,te=!1,ie=!1,me=!1;function O(_,M,P){(P||_!=i.width||M!=i.height)&&re(_,M),ft(!1),xe=!0,ve=!0,li()}function re(_,M){i.width=ln=F=_,i.height=Sn=Pe=M,Ye=ot=0,Se(),Ge();let P=i.bbox;C=P.left=aa(Ye*Ct,.5),S=P.top=aa(ot*Ct,.5),X=P.width=aa(F*Ct,.5),ue=P.height=aa(Pe*Ct,.5)}let ne=3;function Ee(){let _=!1,M=0;for(;!_;){M++;let P=_a(M),L=Us(M);_=M==ne||P&&L,_||(re(i.width,i.height),ve=!0)}}function _e({width:_,height:M}){O(_,M)}i.setSize=_e;function Se(){let _=!1,M=!1,P=!1,L=!1;T.forEach(($,Z)=>{if($.show&&$._show){let{side:ae,_size:fe}=$,be=ae%2,Ne=$.label!=null?$.labelSize:0,Oe=fe+Ne;Oe>0&&(be?(F-=Oe,ae==3?(Ye+=Oe,L=!0):P=!0):(Pe-=Oe,ae==0?(ot+=Oe,_=!0):M=!0))}}),Ds[0]=_,Ds[1]=P,Ds[2]=M,Ds[3]=L,F-=gs[1]+gs[3],Ye+=gs[3],Pe-=gs[2]+gs[0],ot+=gs[0]}function Ge(){let _=Ye+F,M=ot+Pe,P=Ye,L=ot;function $(Z,ae){switch(Z){case 1:return _+=ae,_-ae;case 2:return M+=ae,M-ae;case 3:return P-=ae,P+ae;case 0:return L-=ae,L+ae}}T.forEach((Z,ae)=>{if(Z.show&&Z._show){let fe=Z.side;Z._pos=$(fe,Z._size),Z.label!=null&&(Z._lpos=$(fe,Z.labelSize))}})}if(he.dataIdx==null){let _=he.hover,M=_.skip=new Set(_.skip??[]);M.add(void 0);let P=_.prox=St(_.prox),L=_.bias??=0;he.dataIdx=($,Z,ae,fe)=>{if(Z==0)return ae;let be=ae,Ne=P($,Z,ae,fe)??Wt,Oe=Ne>=0&&Ne<Wt,Be=I.ori==0?F:Pe,st=he.left,At=e[0],Et=e[Z];if(M.has(Et[ae])){be=null;let yt=null,Je=null,Xe;if(L==0||L==-1)for(Xe=ae;yt==null&&Xe-- >0;)M.has(Et[Xe])||(yt=Xe);if(L==0||L==1)for(Xe=ae;Je==null&&Xe++<Et.length;)M.has(Et[Xe])||(Je=Xe);if(yt!=null||Je!=null)if(Oe){let Kt=yt==null?-1/0:H(At[yt],I,Be,0),hn=Je==null?1/0:H(At[Je],I,Be,0),Yn=st-Kt,kt=hn-st;Yn<=kt?Yn<=Ne&&(be=yt):kt<=Ne&&(be=Je)}else be=Je==null?yt:yt==null?Je:ae-yt<=Je-ae?yt:Je}else Oe&&Hn(st-H(At[ae],I,Be,0))>Ne&&(be=null);return be}}let Ke=_=>{he.event=_};he.idxs=se,he._lock=!1;let le=he.points;le.show=St(le.show),le.size=St(le.size),le.stroke=St(le.stroke),le.width=St(le.width),le.fill=St(le.fill);let ke=i.focus=Ln({},n.focus||{alpha:.3},he.focus),Qe=ke.prox>=0,Re=Qe&&le.one,ct=[],jt=[],yi=[];function zl(_,M){let P=le.show(i,M);if(P instanceof HTMLElement)return Ji(P,lP),Ji(P,_.class),sr(P,-10,-10,F,Pe),m.insertBefore(P,ct[M]),P}function pa(_,M){if(s==1||M>0){let P=s==1&&b[_.scale].time,L=_.value;_.value=P?Ab(L)?Nb(Y,Db(L,W)):L||Q:L||S3,_.label=_.label||(P?p3:f3)}if(Re||M>0){_.width=_.width==null?1:_.width,_.paths=_.paths||O3||TP,_.fillTo=St(_.fillTo||A3),_.pxAlign=+Tt(_.pxAlign,y),_.pxRound=$b(_.pxAlign),_.stroke=St(_.stroke||null),_.fill=St(_.fill||null),_._stroke=_._fill=_._paths=_._focus=null;let P=M3(Ni(1,_.width),1),L=_.points=Ln({},{size:P,width:Ni(1,P*.2),stroke:_.stroke,space:P*2,paths:F3,_stroke:null,_fill:null},_.points);L.show=St(L.show),L.filter=St(L.filter),L.fill=St(L.fill),L.stroke=St(L.stroke),L.paths=St(L.paths),L.pxAlign=_.pxAlign}if(ee){let P=Bt(_,M);rt.splice(M,0,P[0]),$e.splice(M,0,P[1]),de.values.push(null)}if(ge){se.splice(M,0,null);let P=null;Re?M==0&&(P=zl(_,M)):M>0&&(P=zl(_,M)),ct.splice(M,0,P),jt.splice(M,0,0),yi.splice(M,0,0)}qn("addSeries",M)}function Zf(_,M){M=M??x.length,_=s==1?Fg(_,M,Ob,Vb):Fg(_,M,{},zb),x.splice(M,0,_),pa(x[M],M)}i.addSeries=Zf;function Su(_){if(x.splice(_,1),ee){de.values.splice(_,1),$e.splice(_,1);let M=rt.splice(_,1)[0];Nn(null,M.firstChild),M.remove()}ge&&(se.splice(_,1),ct.splice(_,1)[0].remove(),jt.splice(_,1),yi.splice(_,1)),qn("delSeries",_)}i.delSeries=Su;let Ds=[!1,!1,!1,!1];function rr(_,M){if(_._show=_.show,_.show){let P=_.side%2,L=b[_.scale];L==null&&(_.scale=P?x[1].scale:A,L=b[_.scale]);let $=L.time;_.size=St(_.size),_.space=St(_.space),_.rotate=St(_.rotate),yo(_.incrs)&&_.incrs.forEach(ae=>{!xo.has(ae)&&xo.set(ae,nS(ae))}),_.incrs=St(_.incrs||(L.distr==2?YP:$?p==1?ZP:QP:la)),_.splits=St(_.splits||($&&L.distr==1?ce:L.distr==3?Dg:L.distr==4?_3:g3)),_.stroke=St(_.stroke),_.grid.stroke=St(_.grid.stroke),_.ticks.stroke=St(_.ticks.stroke),_.border.stroke=St(_.border.stroke);let Z=_.values;_.values=yo(Z)&&!yo(Z[0])?St(Z):$?yo(Z)?Lb(Y,Ib(Z,W)):Ab(Z)?n3(Y,Z):Z||J:Z||m3,_.filter=St(_.filter||(L.distr>=3&&L.log==10?x3:L.distr==3&&L.log==2?b3:eS)),_.font=qb(_.font),_.labelFont=qb(_.labelFont),_._size=_.size(i,null,M,0),_._space=_._rotate=_._incrs=_._found=_._splits=_._values=null,_._size>0&&(Ds[M]=!0,_._el=fs(sP,d))}}function or(_,M,P,L){let[$,Z,ae,fe]=P,be=M%2,Ne=0;return be==0&&(fe||Z)&&(Ne=M==0&&!$||M==2&&!ae?Vn(Ub.size/3):0),be==1&&($||ae)&&(Ne=M==1&&!Z||M==3&&!fe?Vn(Bb.size/2):0),Ne}let Vl=i.padding=(n.padding||[or,or,or,or]).map(_=>St(Tt(_,or))),gs=i._padding=Vl.map((_,M)=>_(i,M,Ds,0)),cn,gn=null,_n=null,Ns=s==1?x[0].idxs:null,zi=null,Or=!1;function Hl(_,M){if(e=_??[],i.data=i._data=e,s==2){cn=0;for(let P=1;P<x.length;P++)cn+=e[P][0].length}else{e.length==0&&(i.data=i._data=e=[[]]),zi=e[0],cn=zi.length;let P=e;if(z==2){P=e.slice();let L=P[0]=Array(cn);for(let $=0;$<cn;$++)L[$]=$}i._data=e=P}if(ft(!0),qn("setData"),z==2&&(xe=!0),M!==!1){let P=I;P.auto(i,Or)?$l():kr(A,P.min,P.max),te=te||he.left>=0,me=!0,li()}}i.setData=Hl;function $l(){Or=!0;let _,M;s==1&&(cn>0?(gn=Ns[0]=0,_n=Ns[1]=cn-1,_=e[0][gn],M=e[0][_n],z==2?(_=gn,M=_n):_==M&&(z==3?[_,M]=kf(_,_,I.log,!1):z==4?[_,M]=Vg(_,_,I.log,!1):I.time?M=_+Vn(86400/p):[_,M]=Of(_,M,Hg,!0))):(gn=Ns[0]=_=null,_n=Ns[1]=M=null)),kr(A,_,M)}let ma,Fr,ga,w,V,K,q,j,Te,Le;function Ae(_,M,P,L,$,Z){_??=ub,P??=Gg,L??="butt",$??=ub,Z??="round",_!=ma&&(h.strokeStyle=ma=_),$!=Fr&&(h.fillStyle=Fr=$),M!=ga&&(h.lineWidth=ga=M),Z!=V&&(h.lineJoin=V=Z),L!=K&&(h.lineCap=K=L),P!=w&&h.setLineDash(w=P)}function De(_,M,P,L){M!=Fr&&(h.fillStyle=Fr=M),_!=q&&(h.font=q=_),P!=j&&(h.textAlign=j=P),L!=Te&&(h.textBaseline=Te=L)}function Ve(_,M,P,L,$=0){if(L.length>0&&_.auto(i,Or)&&(M==null||M.min==null)){let Z=Tt(gn,0),ae=Tt(_n,L.length-1),fe=P.min==null?xP(L,Z,ae,$,_.distr==3):[P.min,P.max];_.min=Ls(_.min,P.min=fe[0]),_.max=Ni(_.max,P.max=fe[1])}}let et={min:null,max:null};function gt(){for(let L in b){let $=b[L];G[L]==null&&($.min==null||G[A]!=null&&$.auto(i,Or))&&(G[L]=et)}for(let L in b){let $=b[L];G[L]==null&&$.from!=null&&G[$.from]!=null&&(G[L]=et)}G[A]!=null&&ft(!0);let _={};for(let L in G){let $=G[L];if($!=null){let Z=_[L]=Dl(b[L],RP);if($.min!=null)Ln(Z,$);else if(L!=A||s==2)if(cn==0&&Z.from==null){let ae=Z.range(i,null,null,L);Z.min=ae[0],Z.max=ae[1]}else Z.min=Wt,Z.max=-Wt}}if(cn>0){x.forEach((L,$)=>{if(s==1){let Z=L.scale,ae=G[Z];if(ae==null)return;let fe=_[Z];if($==0){let be=fe.range(i,fe.min,fe.max,Z);fe.min=be[0],fe.max=be[1],gn=Is(fe.min,e[0]),_n=Is(fe.max,e[0]),_n-gn>1&&(e[0][gn]<fe.min&&gn++,e[0][_n]>fe.max&&_n--),L.min=zi[gn],L.max=zi[_n]}else L.show&&L.auto&&Ve(fe,ae,L,e[$],L.sorted);L.idxs[0]=gn,L.idxs[1]=_n}else if($>0&&L.show&&L.auto){let[Z,ae]=L.facets,fe=Z.scale,be=ae.scale,[Ne,Oe]=e[$],Be=_[fe],st=_[be];Be!=null&&Ve(Be,G[fe],Z,Ne,Z.sorted),st!=null&&Ve(st,G[be],ae,Oe,ae.sorted),L.min=ae.min,L.max=ae.max}});for(let L in _){let $=_[L],Z=G[L];if($.from==null&&(Z==null||Z.min==null)){let ae=$.range(i,$.min==Wt?null:$.min,$.max==-Wt?null:$.max,L);$.min=ae[0],$.max=ae[1]}}}for(let L in _){let $=_[L];if($.from!=null){let Z=_[$.from];if(Z.min==null)$.min=$.max=null;else{let ae=$.range(i,Z.min,Z.max,L);$.min=ae[0],$.max=ae[1]}}}let M={},P=!1;for(let L in _){let $=_[L],Z=b[L];if(Z.min!=$.min||Z.max!=$.max){Z.min=$.min,Z.max=$.max;let ae=Z.distr;Z._min=ae==3?Dr(Z.min):ae==4?wg(Z.min,Z.asinh):ae==100?Z.fwd(Z.min):Z.min,Z._max=ae==3?Dr(Z.max):ae==4?wg(Z.max,Z.asinh):ae==100?Z.fwd(Z.max):Z.max,M[L]=P=!0}}if(P){x.forEach((L,$)=>{s==2?$>0&&M.y&&(L._paths=null):M[L.scale]&&(L._paths=null)});for(let L in M)xe=!0,qn("setScale",L);ge&&he.left>=0&&(te=me=!0)}for(let L in G)G[L]=null}function ze(_){let M=Lg(gn-1,0,cn-1),P=Lg(_n+1,0,cn-1);for(;_[M]==null&&M>0;)M--;for(;_[P]==null&&P<cn-1;)P++;return[M,P]}function _t(){if(cn>0){let _=x.some(M=>M._focus)&&Le!=ke.alpha;_&&(h.globalAlpha=Le=ke.alpha),x.forEach((M,P)=>{if(P>0&&M.show&&(an(P,!1),an(P,!0),M._paths==null)){let L=Le;Le!=M.alpha&&(h.globalAlpha=Le=M.alpha);let $=s==2?[0,e[P][0].length-1]:ze(e[P]);M._paths=M.paths(i,P,$[0],$[1]),Le!=L&&(h.globalAlpha=Le=L)}}),x.forEach((M,P)=>{if(P>0&&M.show){let L=Le;Le!=M.alpha&&(h.globalAlpha=Le=M.alpha),M._paths!=null&&Nt(P,!1);{let $=M._paths!=null?M._paths.gaps:null,Z=M.points.show(i,P,gn,_n,$),ae=M.points.filter(i,P,Z,$);(Z||ae)&&(M.points._paths=M.points.paths(i,P,gn,_n,ae),Nt(P,!0))}Le!=L&&(h.globalAlpha=Le=L),qn("drawSeries",P)}}),_&&(h.globalAlpha=Le=1)}}function an(_,M){let P=M?x[_].points:x[_];P._stroke=P.stroke(i,_),P._fill=P.fill(i,_)}function Nt(_,M){let P=M?x[_].points:x[_],{stroke:L,fill:$,clip:Z,flags:ae,_stroke:fe=P._stroke,_fill:be=P._fill,_width:Ne=P.width}=P._paths;Ne=Xt(Ne*Ct,3);let Oe=null,Be=Ne%2/2;M&&be==null&&(be=Ne>0?"#fff":fe);let st=P.pxAlign==1&&Be>0;if(st&&h.translate(Be,Be),!M){let At=C-Ne/2,Et=S-Ne/2,yt=X+Ne,Je=ue+Ne;Oe=new Path2D,Oe.rect(At,Et,yt,Je)}M?Fe(fe,Ne,P.dash,P.cap,be,L,$,ae,Z):Ut(_,fe,Ne,P.dash,P.cap,be,L,$,ae,Oe,Z),st&&h.translate(-Be,-Be)}function Ut(_,M,P,L,$,Z,ae,fe,be,Ne,Oe){let Be=!1;be!=0&&R.forEach((st,At)=>{if(st.series[0]==_){let Et=x[st.series[1]],yt=e[st.series[1]],Je=(Et._paths||yu).band;yo(Je)&&(Je=st.dir==1?Je[0]:Je[1]);let Xe,Kt=null;Et.show&&Je&&SP(yt,gn,_n)?(Kt=st.fill(i,At)||Z,Xe=Et._paths.clip):Je=null,Fe(M,P,L,$,Kt,ae,fe,be,Ne,Oe,Xe,Je),Be=!0}}),Be||Fe(M,P,L,$,Z,ae,fe,be,Ne,Oe)}let Un=Nl|Ug;function Fe(_,M,P,L,$,Z,ae,fe,be,Ne,Oe,Be){Ae(_,M,P,L,$),(be||Ne||Be)&&(h.save(),be&&h.clip(be),Ne&&h.clip(Ne)),Be?(fe&Un)==Un?(h.clip(Be),Oe&&h.clip(Oe),bt($,ae),Mn(_,Z,M)):fe&Ug?(bt($,ae),h.clip(Be),Mn(_,Z,M)):fe&Nl&&(h.save(),h.clip(Be),Oe&&h.clip(Oe),bt($,ae),h.restore(),Mn(_,Z,M)):(bt($,ae),Mn(_,Z,M)),(be||Ne||Be)&&h.restore()}function Mn(_,M,P){P>0&&(M instanceof Map?M.forEach((L,$)=>{h.strokeStyle=ma=$,h.stroke(L)}):M!=null&&_&&h.stroke(M))}function bt(_,M){M instanceof Map?M.forEach((P,L)=>{h.fillStyle=Fr=L,h.fill(P)}):M!=null&&_&&h.fill(M)}function ar(_,M,P,L){let $=T[_],Z;if(L<=0)Z=[0,0];else{let ae=$._space=$.space(i,_,M,P,L),fe=$._incrs=$.incrs(i,_,M,P,L,ae);Z=$3(M,P,fe,L,ae)}return $._found=Z}function wn(_,M,P,L,$,Z,ae,fe,be,Ne){let Oe=ae%2/2;y==1&&h.translate(Oe,Oe),Ae(fe,ae,be,Ne,fe),h.beginPath();let Be,st,At,Et,yt=$+(L==0||L==3?-Z:Z);P==0?(st=$,Et=yt):(Be=$,At=yt);for(let Je=0;Je<_.length;Je++)M[Je]!=null&&(P==0?Be=At=_[Je]:st=Et=_[Je],h.moveTo(Be,st),h.lineTo(At,Et));h.stroke(),y==1&&h.translate(-Oe,-Oe)}function _a(_){let M=!0;return T.forEach((P,L)=>{if(!P.show)return;let $=b[P.scale];if($.min==null){P._show&&(M=!1,P._show=!1,ft(!1));return}else P._show||(M=!1,P._show=!0,ft(!1));let Z=P.side,ae=Z%2,{min:fe,max:be}=$,[Ne,Oe]=ar(L,fe,be,ae==0?F:Pe);if(Oe==0)return;let Be=$.distr==2,st=P._splits=P.splits(i,L,fe,be,Ne,Oe,Be),At=$.distr==2?st.map(Xe=>zi[Xe]):st,Et=$.distr==2?zi[st[1]]-zi[st[0]]:Ne,yt=P._values=P.values(i,P.filter(i,At,L,Oe,Et),L,Oe,Et);P._rotate=Z==2?P.rotate(i,yt,L,Oe):0;let Je=P._size;P._size=ps(P.size(i,yt,L,_)),Je!=null&&P._size!=Je&&(M=!1)}),M}function Us(_){let M=!0;return Vl.forEach((P,L)=>{let $=P(i,L,Ds,_);$!=gs[L]&&(M=!1),gs[L]=$}),M}function lr(){for(let _=0;_<T.length;_++){let M=T[_];if(!M.show||!M._show)continue;let P=M.side,L=P%2,$,Z,ae=M.stroke(i,_),fe=P==0||P==3?-1:1,[be,Ne]=M._found;if(M.label!=null){let Si=M.labelGap*fe,$i=Vn((M._lpos+Si)*Ct);De(M.labelFont[0],ae,"center",P==2?"top":cb),h.save(),L==1?($=Z=0,h.translate($i,Vn(S+ue/2)),h.rotate((P==3?-Nf:Nf)/2)):($=Vn(C+X/2),Z=$i);let Ao=Kb(M.label)?M.label(i,_,be,Ne):M.label;h.fillText(Ao,$,Z),h.restore()}if(Ne==0)continue;let Oe=b[M.scale],Be=L==0?X:ue,st=L==0?C:S,At=M._splits,Et=Oe.distr==2?At.map(Si=>zi[Si]):At,yt=Oe.distr==2?zi[At[1]]-zi[At[0]]:be,Je=M.ticks,Xe=M.border,Kt=Je.show?Je.size:0,hn=Vn(Kt*Ct),Yn=Vn((M.alignTo==2?M._size-Kt-M.gap:M.gap)*Ct),kt=M._rotate*-Nf/180,dn=g(M._pos*Ct),Vi=(hn+Yn)*fe,bi=dn+Vi;Z=L==0?bi:0,$=L==1?bi:0;let es=M.font[0],_s=M.align==1?Cl:M.align==2?bg:kt>0?Cl:kt<0?bg:L==0?"center":P==3?bg:Cl,Bs=kt||L==1?"middle":P==2?"top":cb;De(es,ae,_s,Bs);let Hi=M.font[1]*M.lineGap,ts=At.map(Si=>g(a(Si,Oe,Be,st))),vs=M._values;for(let Si=0;Si<vs.length;Si++){let $i=vs[Si];if($i!=null){L==0?$=ts[Si]:Z=ts[Si],$i=""+$i;let Ao=$i.indexOf(`
`)==-1?[$i]:$i.split(/\n/gm);for(let Mi=0;Mi<Ao.length;Mi++){let T0=Ao[Mi];kt?(h.save(),h.translate($,Z+Mi*Hi),h.rotate(kt),h.fillText(T0,0,0),h.restore()):h.fillText(T0,$,Z+Mi*Hi)}}}Je.show&&wn(ts,Je.filter(i,Et,_,Ne,yt),L,P,dn,hn,Xt(Je.width*Ct,3),Je.stroke(i,_),Je.dash,Je.cap);let ks=M.grid;ks.show&&wn(ts,ks.filter(i,Et,_,Ne,yt),L,L==0?2:1,L==0?S:C,L==0?ue:X,Xt(ks.width*Ct,3),ks.stroke(i,_),ks.dash,ks.cap),Xe.show&&wn([dn],[1],L==0?1:0,L==0?1:2,L==1?S:C,L==1?ue:X,Xt(Xe.width*Ct,3),Xe.stroke(i,_),Xe.dash,Xe.cap)}qn("drawAxes")}function ft(_){x.forEach((M,P)=>{P>0&&(M._paths=null,_&&(s==1?(M.min=null,M.max=null):M.facets.forEach(L=>{L.min=null,L.max=null})))})}let un=!1,xi=!1,Ot=[];function En(){xi=!1;for(let _=0;_<Ot.length;_++)qn(...Ot[_]);Ot.length=0}function li(){un||(OP(l0),un=!0)}function Mu(_,M=!1){un=!0,xi=M,_(i),l0(),M&&Ot.length>0&&queueMicrotask(En)}i.batch=Mu;function l0(){if(oe&&(gt(),oe=!1),xe&&(Ee(),xe=!1),ve){if(tn(f,Cl,Ye),tn(f,"top",ot),tn(f,mu,F),tn(f,gu,Pe),tn(m,Cl,Ye),tn(m,"top",ot),tn(m,mu,F),tn(m,gu,Pe),tn(d,mu,ln),tn(d,gu,Sn),u.width=Vn(ln*Ct),u.height=Vn(Sn*Ct),T.forEach(({_el:_,_show:M,_size:P,_pos:L,side:$})=>{if(_!=null)if(M){let Z=$===3||$===0?P:0,ae=$%2==1;tn(_,ae?"left":"top",L-Z),tn(_,ae?"width":"height",P),tn(_,ae?"top":"left",ae?ot:Ye),tn(_,ae?"height":"width",ae?Pe:F),Pg(_,ca)}else Ji(_,ca)}),ma=Fr=ga=V=K=q=j=Te=w=null,Le=1,Xl(!0),Ye!=we||ot!=Ht||F!=He||Pe!=qe){ft(!1);let _=F/He,M=Pe/qe;if(ge&&!te&&he.left>=0){he.left*=_,he.top*=M,va&&sr(va,Vn(he.left),0,F,Pe),ya&&sr(ya,0,Vn(he.top),F,Pe);for(let P=0;P<ct.length;P++){let L=ct[P];L!=null&&(jt[P]*=_,yi[P]*=M,sr(L,ps(jt[P]),ps(yi[P]),F,Pe))}}if(Jt.show&&!ie&&Jt.left>=0&&Jt.width>0){Jt.left*=_,Jt.width*=_,Jt.top*=M,Jt.height*=M;for(let P in np)tn(Sa,P,Jt[P])}we=Ye,Ht=ot,He=F,qe=Pe}qn("setSize"),ve=!1}ln>0&&Sn>0&&(h.clearRect(0,0,u.width,u.height),qn("drawClear"),E.forEach(_=>_()),qn("draw")),Jt.show&&ie&&(wu(Jt),ie=!1),ge&&te&&(To(null,!0,!1),te=!1),de.show&&de.live&&me&&(ep(),me=!1),l||(l=!0,i.status=1,qn("ready")),Or=!1,un=!1}i.redraw=(_,M)=>{xe=M||!1,_!==!1?kr(A,I.min,I.max):li()};function Jf(_,M){let P=b[_];if(P.from==null){if(cn==0){let L=P.range(i,M.min,M.max,_);M.min=L[0],M.max=L[1]}if(M.min>M.max){let L=M.min;M.min=M.max,M.max=L}if(cn>1&&M.min!=null&&M.max!=null&&M.max-M.min<1e-16)return;_==A&&P.distr==2&&cn>0&&(M.min=Is(M.min,e[0]),M.max=Is(M.max,e[0]),M.min==M.max&&M.max++),G[_]=M,oe=!0,li()}}i.setScale=Jf;let Kf,Qf,va,ya,c0,u0,xa,ba,h0,d0,Zt,sn,Br=!1,Qn=he.drag,Wn=Qn.x,Xn=Qn.y;ge&&(he.x&&(Kf=fs(oP,m)),he.y&&(Qf=fs(aP,m)),I.ori==0?(va=Kf,ya=Qf):(va=Qf,ya=Kf),Zt=he.left,sn=he.top);let Jt=i.select=Ln({show:!0,over:!0,left:0,width:0,top:0,height:0},n.select),Sa=Jt.show?fs(rP,Jt.over?m:f):null;function wu(_,M){if(Jt.show){for(let P in _)Jt[P]=_[P],P in np&&tn(Sa,P,_[P]);M!==!1&&qn("setSelect")}}i.setSelect=wu;function rM(_){if(x[_].show)ee&&Pg(rt[_],ca);else if(ee&&Ji(rt[_],ca),ge){let P=Re?ct[0]:ct[_];P!=null&&sr(P,-10,-10,F,Pe)}}function kr(_,M,P){Jf(_,{min:M,max:P})}function Os(_,M,P,L){M.focus!=null&&uM(_),M.show!=null&&x.forEach(($,Z)=>{Z>0&&(_==Z||_==null)&&($.show=M.show,rM(Z),s==2?(kr($.facets[0].scale,null,null),kr($.facets[1].scale,null,null)):kr($.scale,null,null),li())}),P!==!1&&qn("setSeries",_,M),L&&ql("setSeries",i,_,M)}i.setSeries=Os;function oM(_,M){Ln(R[_],M)}function aM(_,M){_.fill=St(_.fill||null),_.dir=Tt(_.dir,-1),M=M??R.length,R.splice(M,0,_)}function lM(_){_==null?R.length=0:R.splice(_,1)}i.addBand=aM,i.setBand=oM,i.delBand=lM;function cM(_,M){x[_].alpha=M,ge&&ct[_]!=null&&(ct[_].style.opacity=M),ee&&rt[_]&&(rt[_].style.opacity=M)}let cr,zr,Eo,Ma={focus:!0};function uM(_){if(_!=Eo){let M=_==null,P=ke.alpha!=1;x.forEach((L,$)=>{if(s==1||$>0){let Z=M||$==0||$==_;L._focus=M?null:Z,P&&cM($,Z?1:ke.alpha)}}),Eo=_,P&&li()}}ee&&Qe&&Mt(fb,Ce,_=>{he._lock||(Ke(_),Eo!=null&&Os(null,Ma,!0,Tn.setSeries))});function Fs(_,M,P){let L=b[M];P&&(_=_/Ct-(L.ori==1?ot:Ye));let $=F;L.ori==1&&($=Pe,_=$-_),L.dir==-1&&(_=$-_);let Z=L._min,ae=L._max,fe=_/$,be=Z+(ae-Z)*fe,Ne=L.distr;return Ne==3?Il(10,be):Ne==4?wP(be,L.asinh):Ne==100?L.bwd(be):be}function hM(_,M){let P=Fs(_,A,M);return Is(P,e[0],gn,_n)}i.valToIdx=_=>Is(_,e[0]),i.posToIdx=hM,i.posToVal=Fs,i.valToPos=(_,M,P)=>b[M].ori==0?r(_,b[M],P?X:F,P?C:0):o(_,b[M],P?ue:Pe,P?S:0),i.setCursor=(_,M,P)=>{Zt=_.left,sn=_.top,To(null,M,P)};function f0(_,M){tn(Sa,Cl,Jt.left=_),tn(Sa,mu,Jt.width=M)}function p0(_,M){tn(Sa,"top",Jt.top=_),tn(Sa,gu,Jt.height=M)}let Gl=I.ori==0?f0:p0,Wl=I.ori==1?f0:p0;function dM(){if(ee&&de.live)for(let _=s==2?1:0;_<x.length;_++){if(_==0&&dt)continue;let M=de.values[_],P=0;for(let L in M)$e[_][P++].firstChild.nodeValue=M[L]}}function ep(_,M){if(_!=null&&(_.idxs?_.idxs.forEach((P,L)=>{se[L]=P}):CP(_.idx)||se.fill(_.idx),de.idx=se[0]),ee&&de.live){for(let P=0;P<x.length;P++)(P>0||s==1&&!dt)&&fM(P,se[P]);dM()}me=!1,M!==!1&&qn("setLegend")}i.setLegend=ep;function fM(_,M){let P=x[_],L=_==0&&z==2?zi:e[_],$;dt?$=P.values(i,_,M)??it:($=P.value(i,M==null?null:L[M],_,M),$=$==null?it:{_:$}),de.values[_]=$}function To(_,M,P){h0=Zt,d0=sn,[Zt,sn]=he.move(i,Zt,sn),he.left=Zt,he.top=sn,ge&&(va&&sr(va,Vn(Zt),0,F,Pe),ya&&sr(ya,0,Vn(sn),F,Pe));let L,$=gn>_n;cr=Wt,zr=null;let Z=I.ori==0?F:Pe,ae=I.ori==1?F:Pe;if(Zt<0||cn==0||$){L=he.idx=null;for(let fe=0;fe<x.length;fe++){let be=ct[fe];be!=null&&sr(be,-10,-10,F,Pe)}Qe&&Os(null,Ma,!0,_==null&&Tn.setSeries),de.live&&(se.fill(L),me=!0)}else{let fe,be,Ne;s==1&&(fe=I.ori==0?Zt:sn,be=Fs(fe,A),L=he.idx=Is(be,e[0],gn,_n),Ne=H(e[0][L],I,Z,0));let Oe=-10,Be=-10,st=0,At=0,Et=!0,yt="",Je="";for(let Xe=s==2?1:0;Xe<x.length;Xe++){let Kt=x[Xe],hn=se[Xe],Yn=hn==null?null:s==1?e[Xe][hn]:e[Xe][1][hn],kt=he.dataIdx(i,Xe,L,be),dn=kt==null?null:s==1?e[Xe][kt]:e[Xe][1][kt];if(me=me||dn!=Yn||kt!=hn,se[Xe]=kt,Xe>0&&Kt.show){let Vi=kt==null?-10:kt==L?Ne:H(s==1?e[0][kt]:e[Xe][0][kt],I,Z,0),bi=dn==null?-10:N(dn,s==1?b[Kt.scale]:b[Kt.facets[1].scale],ae,0);if(Qe&&dn!=null){let es=I.ori==1?Zt:sn,_s=Hn(ke.dist(i,Xe,kt,bi,es));if(_s<cr){let Bs=ke.bias;if(Bs!=0){let Hi=Fs(es,Kt.scale),ts=dn>=0?1:-1,vs=Hi>=0?1:-1;vs==ts&&(vs==1?Bs==1?dn>=Hi:dn<=Hi:Bs==1?dn<=Hi:dn>=Hi)&&(cr=_s,zr=Xe)}else cr=_s,zr=Xe}}if(me||Re){let es,_s;I.ori==0?(es=Vi,_s=bi):(es=bi,_s=Vi);let Bs,Hi,ts,vs,ks,Si,$i=!0,Ao=le.bbox;if(Ao!=null){$i=!1;let Mi=Ao(i,Xe);ts=Mi.left,vs=Mi.top,Bs=Mi.width,Hi=Mi.height}else ts=es,vs=_s,Bs=Hi=le.size(i,Xe);if(Si=le.fill(i,Xe),ks=le.stroke(i,Xe),Re)Xe==zr&&cr<=ke.prox&&(Oe=ts,Be=vs,st=Bs,At=Hi,Et=$i,yt=Si,Je=ks);else{let Mi=ct[Xe];Mi!=null&&(jt[Xe]=ts,yi[Xe]=vs,xb(Mi,Bs,Hi,$i),vb(Mi,Si,ks),sr(Mi,ps(ts),ps(vs),F,Pe))}}}}if(Re){let Xe=ke.prox,Kt=Eo==null?cr<=Xe:cr>Xe||zr!=Eo;if(me||Kt){let hn=ct[0];hn!=null&&(jt[0]=Oe,yi[0]=Be,xb(hn,st,At,Et),vb(hn,yt,Je),sr(hn,ps(Oe),ps(Be),F,Pe))}}}if(Jt.show&&Br)if(_!=null){let[fe,be]=Tn.scales,[Ne,Oe]=Tn.match,[Be,st]=_.cursor.sync.scales,At=_.cursor.drag;if(Wn=At._x,Xn=At._y,Wn||Xn){let{left:Et,top:yt,width:Je,height:Xe}=_.select,Kt=_.scales[Be].ori,hn=_.posToVal,Yn,kt,dn,Vi,bi,es=fe!=null&&Ne(fe,Be),_s=be!=null&&Oe(be,st);es&&Wn?(Kt==0?(Yn=Et,kt=Je):(Yn=yt,kt=Xe),dn=b[fe],Vi=H(hn(Yn,Be),dn,Z,0),bi=H(hn(Yn+kt,Be),dn,Z,0),Gl(Ls(Vi,bi),Hn(bi-Vi))):Gl(0,Z),_s&&Xn?(Kt==1?(Yn=Et,kt=Je):(Yn=yt,kt=Xe),dn=b[be],Vi=N(hn(Yn,st),dn,ae,0),bi=N(hn(Yn+kt,st),dn,ae,0),Wl(Ls(Vi,bi),Hn(bi-Vi))):Wl(0,ae)}else ip()}else{let fe=Hn(h0-c0),be=Hn(d0-u0);if(I.ori==1){let st=fe;fe=be,be=st}Wn=Qn.x&&fe>=Qn.dist,Xn=Qn.y&&be>=Qn.dist;let Ne=Qn.uni;Ne!=null?Wn&&Xn&&(Wn=fe>=Ne,Xn=be>=Ne,!Wn&&!Xn&&(be>fe?Xn=!0:Wn=!0)):Qn.x&&Qn.y&&(Wn||Xn)&&(Wn=Xn=!0);let Oe,Be;Wn&&(I.ori==0?(Oe=xa,Be=Zt):(Oe=ba,Be=sn),Gl(Ls(Oe,Be),Hn(Be-Oe)),Xn||Wl(0,ae)),Xn&&(I.ori==1?(Oe=xa,Be=Zt):(Oe=ba,Be=sn),Wl(Ls(Oe,Be),Hn(Be-Oe)),Wn||Gl(0,Z)),!Wn&&!Xn&&(Gl(0,0),Wl(0,0))}if(Qn._x=Wn,Qn._y=Xn,_==null){if(P){if(E0!=null){let[fe,be]=Tn.scales;Tn.values[0]=fe!=null?Fs(I.ori==0?Zt:sn,fe):null,Tn.values[1]=be!=null?Fs(I.ori==1?Zt:sn,be):null}ql(Sg,i,Zt,sn,F,Pe,L)}if(Qe){let fe=P&&Tn.setSeries,be=ke.prox;Eo==null?cr<=be&&Os(zr,Ma,!0,fe):cr>be?Os(null,Ma,!0,fe):zr!=Eo&&Os(zr,Ma,!0,fe)}}me&&(de.idx=L,ep()),M!==!1&&qn("setCursor")}let Vr=null;Object.defineProperty(i,"rect",{get(){return Vr==null&&Xl(!1),Vr}});function Xl(_=!1){_?Vr=null:(Vr=m.getBoundingClientRect(),qn("syncRect",Vr))}function m0(_,M,P,L,$,Z,ae){he._lock||Br&&_!=null&&_.movementX==0&&_.movementY==0||(tp(_,M,P,L,$,Z,ae,!1,_!=null),_!=null?To(null,!0,!0):To(M,!0,!1))}function tp(_,M,P,L,$,Z,ae,fe,be){if(Vr==null&&Xl(!1),Ke(_),_!=null)P=_.clientX-Vr.left,L=_.clientY-Vr.top;else{if(P<0||L<0){Zt=-10,sn=-10;return}let[Ne,Oe]=Tn.scales,Be=M.cursor.sync,[st,At]=Be.values,[Et,yt]=Be.scales,[Je,Xe]=Tn.match,Kt=M.axes[0].side%2==1,hn=I.ori==0?F:Pe,Yn=I.ori==1?F:Pe,kt=Kt?Z:$,dn=Kt?$:Z,Vi=Kt?L:P,bi=Kt?P:L;if(Et!=null?P=Je(Ne,Et)?a(st,b[Ne],hn,0):-10:P=hn*(Vi/kt),yt!=null?L=Xe(Oe,yt)?a(At,b[Oe],Yn,0):-10:L=Yn*(bi/dn),I.ori==1){let es=P;P=L,L=es}}be&&(M==null||M.cursor.event.type==Sg)&&((P<=1||P>=F-1)&&(P=aa(P,F)),(L<=1||L>=Pe-1)&&(L=aa(L,Pe))),fe?(c0=P,u0=L,[xa,ba]=he.move(i,P,L)):(Zt=P,sn=L)}let np={width:0,height:0,left:0,top:0};function ip(){wu(np,!1)}let g0,_0,v0,y0;function x0(_,M,P,L,$,Z,ae){Br=!0,Wn=Xn=Qn._x=Qn._y=!1,tp(_,M,P,L,$,Z,ae,!0,!1),_!=null&&(Mt(Mg,Cg,b0,!1),ql(hb,i,xa,ba,F,Pe,null));let{left:fe,top:be,width:Ne,height:Oe}=Jt;g0=fe,_0=be,v0=Ne,y0=Oe}function b0(_,M,P,L,$,Z,ae){Br=Qn._x=Qn._y=!1,tp(_,M,P,L,$,Z,ae,!1,!0);let{left:fe,top:be,width:Ne,height:Oe}=Jt,Be=Ne>0||Oe>0,st=g0!=fe||_0!=be||v0!=Ne||y0!=Oe;if(Be&&st&&wu(Jt),Qn.setScale&&Be&&st){let At=fe,Et=Ne,yt=be,Je=Oe;if(I.ori==1&&(At=be,Et=Oe,yt=fe,Je=Ne),Wn&&kr(A,Fs(At,A),Fs(At+Et,A)),Xn)for(let Xe in b){let Kt=b[Xe];Xe!=A&&Kt.from==null&&Kt.min!=Wt&&kr(Xe,Fs(yt+Je,Xe),Fs(yt,Xe))}ip()}else he.lock&&(he._lock=!he._lock,To(M,!0,_!=null));_!=null&&(Nn(Mg,Cg),ql(Mg,i,Zt,sn,F,Pe,null))}function pM(_,M,P,L,$,Z,ae){if(he._lock)return;Ke(_);let fe=Br;if(Br){let be=!0,Ne=!0,Oe=10,Be,st;I.ori==0?(Be=Wn,st=Xn):(Be=Xn,st=Wn),Be&&st&&(be=Zt<=Oe||Zt>=F-Oe,Ne=sn<=Oe||sn>=Pe-Oe),Be&&be&&(Zt=Zt<xa?0:F),st&&Ne&&(sn=sn<ba?0:Pe),To(null,!0,!0),Br=!1}Zt=-10,sn=-10,se.fill(null),To(null,!0,!0),fe&&(Br=fe)}function S0(_,M,P,L,$,Z,ae){he._lock||(Ke(_),$l(),ip(),_!=null&&ql(pb,i,Zt,sn,F,Pe,null))}function M0(){T.forEach(G3),O(i.width,i.height,!0)}ua(Uf,Pl,M0);let wa={};wa.mousedown=x0,wa.mousemove=m0,wa.mouseup=b0,wa.dblclick=S0,wa.setSeries=(_,M,P,L)=>{let $=Tn.match[2];P=$(i,M,P),P!=-1&&Os(P,L,!0,!1)},ge&&(Mt(hb,m,x0),Mt(Sg,m,m0),Mt(db,m,_=>{Ke(_),Xl(!1)}),Mt(fb,m,pM),Mt(pb,m,S0),Og.add(i),i.syncRect=Xl);let Eu=i.hooks=n.hooks||{};function qn(_,M,P){xi?Ot.push([_,M,P]):_ in Eu&&Eu[_].forEach(L=>{L.call(null,i,M,P)})}(n.plugins||[]).forEach(_=>{for(let M in _.hooks)Eu[M]=(Eu[M]||[]).concat(_.hooks[M])});let w0=(_,M,P)=>P,Tn=Ln({key:null,setSeries:!1,filters:{pub:Eb,sub:Eb},scales:[A,x[1]?x[1].scale:null],match:[Tb,Tb,w0],values:[null,null]},he.sync);Tn.match.length==2&&Tn.match.push(w0),he.sync=Tn;let E0=Tn.key,sp=SS(E0);function ql(_,M,P,L,$,Z,ae){Tn.filters.pub(_,M,P,L,$,Z,ae)&&sp.pub(_,M,P,L,$,Z,ae)}sp.sub(i);function mM(_,M,P,L,$,Z,ae){Tn.filters.sub(_,M,P,L,$,Z,ae)&&wa[_](null,M,P,L,$,Z,ae)}i.pub=mM;function gM(){sp.unsub(i),Og.delete(i),Gn.clear(),Ig(Uf,Pl,M0),c.remove(),Ce?.remove(),qn("destroy")}i.destroy=gM;function rp(){qn("init",n,e),Hl(e||n.data,!1),G[A]?Jf(A,G[A]):$l(),ie=Jt.show&&(Jt.width>0||Jt.height>0),te=me=!0,O(n.width,n.height)}return x.forEach(pa),T.forEach(rr),t?t instanceof HTMLElement?(t.appendChild(c),rp()):t(i,rp):rp(),i}$n.assign=Ln;$n.fmtNum=$g;$n.rangeNum=Of;$n.rangeLog=kf;$n.rangeAsinh=Vg;$n.orient=da;$n.pxRatio=Ct;$n.join=UP;$n.fmtDate=Wg,$n.tzDate=XP;$n.sync=SS;{$n.addGap=C3,$n.clipGaps=Hf;let n=$n.paths={points:CS};n.linear=PS,n.stepped=I3,n.bars=L3,n.spline=N3}var W3=window.matchMedia?.("(hover: none)").matches??!1,OS=26,FS=18,bo=je(null),fa=$t(()=>{let n=Lt.value;return n.id.length?p_(n,f_(n,In.value),oo.value.by,oo.value.down):new Int32Array(0)}),BS=[["state","",30],["from","From → to",104],["kind","Kind",126],["w","w",60],["residual","v",104],["sigma","σ",86],["redundancy","r",46],["value","Value",124],["mdb","MDB",100],["external","Effect",128],["source","Source",210]],X3=Object.fromEntries(BS.map(([n,e])=>[n,e])),q3=n=>g_(BS,n,"from","source"),Y3={state:"active, check or off",sigma:"standard deviation of the value",residual:"residual",redundancy:"redundancy number: 0 is unchecked, 1 wholly checked",w:"normalised residual",mdb:"minimal detectable bias",external:"largest effect of an error of that size that stays undetected, and where"},j3={active:["●","on"],check:["◇","check"],off:["○","off"]},NS=n=>n?.replace(/^-/,"−");function Qg(n,e,t,i){let s=n.words?.[t];switch(t){case"from":return ms(n,e);case"kind":return So(n,e);case"value":return NS(s?.[e])??String(n.value[e]);case"sigma":case"residual":case"mdb":return NS(s?.[e])||Zi(n[t][e],n.unit[e],i);case"external":return n.external[e]===null||n.external[e]===void 0?"–":`${s?.[e]||Zi(n.external[e],"m",i)}${n.external_at[e]?` @ ${n.external_at[e]}`:""}`;case"redundancy":case"w":return Ft(n[t][e],2);case"source":return n.reason?.[e]?`${n.reason[e]} · ${n.source[e]}`:n.source[e];default:return String(n[t][e]??"")}}var ms=(n,e)=>`${n.from[e]}${n.to[e]?` → ${n.to[e]}`:""}`,So=(n,e)=>n.title?.[e]??`${Bi(n.kind[e])}${n.component?.[e]?` ${n.component[e]}`:""}`;function Z3(){let n=Gr(null);return ur(()=>{let e=null,t=Yt(()=>{let i=Lt.value,s=Fi.value==="dark",r=Math.max(200,n.current.clientWidth),o=i.w??[],a=4;for(let y of o)y!==null&&Math.abs(y)<100&&(a=Math.max(a,Math.ceil(Math.abs(y))));let l=Math.min(80,16*Math.ceil(a/2)),c=wy(o,-a,a,l),u=c.map((y,g)=>-a+(g+.5)*2*a/l),h=o.filter((y,g)=>y!=null&&i.state[g]==="active").length,d=u.map(y=>h*2*a/l*(Math.exp(-y*y/2)/Math.sqrt(2*Math.PI))),m={stroke:s?"#9aa7b4":"#5b6875",font:`11px ${oa}`,grid:{show:!1},ticks:{stroke:s?"#39424d":"#cfd6dd",width:1,size:4}};e?.destroy(),e=new $n({width:r,height:104,legend:{show:!1},padding:[6,14,0,0],cursor:{drag:{x:!0,y:!1,setScale:!1},points:{show:!1},y:!1},scales:{x:{time:!1,range:[-a,a]},y:{range:(y,g,p)=>[0,Math.max(1,p*1.08)]}},axes:[{...m,size:22,space:40},{...m,size:34,space:24}],series:[{},{stroke:"#4c8fbd",fill:s?"#2f5f80":"#9cc3dd",width:1,paths:$n.paths.bars({size:[.94,40],align:0}),points:{show:!1}},{stroke:"#d9822b",width:1.5,paths:$n.paths.spline(),points:{show:!1}}],hooks:{setSelect:[y=>{if(y.select.width<3)return;let g=y.posToVal(y.select.left,"x"),p=y.posToVal(y.select.left+y.select.width,"x");In.value={...In.peek(),low:g<-.98*a?null:Number(g.toFixed(2)),high:p>.98*a?null:Number(p.toFixed(2))}}]}},[u,c,d],n.current),e.over.addEventListener("dblclick",()=>{In.value={...In.peek(),low:null,high:null},e.setSelect({left:0,top:0,width:0,height:0},!1)})});return()=>{t(),e?.destroy()}},[]),D`<div class="histogram" ref=${n} role="img" aria-label="Histogram of the normalised residuals w with the normal curve; draw a stretch to filter"></div>`}function J3(){let n=In.value,e=Lt.value,t=r=>In.value={...n,...r},i=JSON.stringify(n)!==JSON.stringify(tc),s=(r,o,a)=>D`<select aria-label=${o} value=${n[r]} onChange=${l=>t({[r]:l.currentTarget.value})}>
    <option value="">${o}</option>${a.map(([l,c])=>D`<option key=${l} value=${l} selected=${n[r]===l}>${c}</option>`)}</select>`;return D`<div class="filters">
    <input type="search" placeholder="Find names, sources, reasons" aria-label="Find" value=${n.text} onInput=${r=>t({text:r.currentTarget.value})} />
    ${s("station","All stations",Fy.value.map(r=>[r,r]))}
    ${s("kind","All kinds",Oy.value.map(r=>[r,Bi(r)]))}
    ${s("state","All states",[["active","on"],["check","check"],["off","off"],["suspicious","suspicious"]])}
    <span class="found">${Gt(fa.value.length)} of ${Gt(Tp(e))}${n.low!==null||n.high!==null?D` · w ${n.low??"−∞"} to ${n.high??"∞"}`:""}</span>
    ${i&&D`<button type="button" class="button plain" onClick=${()=>In.value={...tc}}>Show all</button>`}
    <span class="links"><a href="tables/observations.csv" download>CSV</a> <a href="tables/observations.json" target="_blank" rel="noopener">JSON</a></span>
  </div>`}var kS=(n,e)=>n.map((t,i)=>D`<div key=${i} role="presentation" class=${i?"line-of further":"line-of"} style=${{height:`${i?FS:OS}px`}}>${t.map(({name:s,width:r})=>e(s,{width:`${r}px`}))}</div>`);function K3({lines:n,width:e}){let{by:t,down:i}=oo.value;return D`<div class="row head" role="row" style=${{width:`${e}px`}}>
    ${kS(n,(s,r)=>D`<button type="button" key=${s} role="columnheader" class=${`cell c-${s} ${t===s?"sorted":""}`} style=${r}
      title=${Y3[s]??""} aria-sort=${t===s?i?"descending":"ascending":"none"}
      onClick=${()=>oo.value={by:s,down:t===s?!i:["w","mdb","external","residual","sigma"].includes(s)}}>
      ${s==="state"?D`<span class="sr">use</span>`:X3[s]}${t===s?i?" ↓":" ↑":""}</button>`)}
  </div>`}function Q3({i:n,at:e,o:t,angle:i,does:s,live:r,lines:o,width:a,height:l}){let c=t.id[n],u=t.state[n],h=Vt.value?.type==="row"&&Vt.value.id===c,d=Ii.value.has(c),[f,m]=j3[u]??["?",u];return D`<div role="row" aria-rowindex=${e+2} aria-selected=${h||d} class=${`row is-${u} ${t.suspicious[n]?"suspicious":""} ${h||d?"picked":""}`}
    style=${{transform:`translateY(${e*l}px)`,width:`${a}px`,height:`${l}px`}}
    onClick=${y=>s.row(n,e,y)} onMouseEnter=${()=>s.hover(n)} onDblClick=${()=>s.visitRow(n)}>
    ${kS(o,(y,g)=>{if(y==="state")return D`<span role="gridcell" key=${y} class="cell c-state" style=${g}>
          ${r?D`<button type="button" class=${`use ${u}`} tabindex="-1" title=${`${m}: change`} aria-label=${`${ms(t,n)} is ${m}: change`} onClick=${x=>{x.stopPropagation(),s.use([c])}}>${f}</button>`:D`<span class=${`use ${u}`} title=${m}>${f}</span>`}</span>`;let p=Qg(t,n,y,i);return D`<span role="gridcell" key=${y} class=${`cell c-${y}`} style=${g} title=${p}>${p}</span>`})}
  </div>`}function eI(){let n=bo.value;return Js.value||!wt.value?null:!n||n.revision!==wt.value.revision?D`<div class="what-if muted">${W3?"Tap":"Rest on"} a red row: what would happen without it?</div>`:n.words===void 0?D`<div class="what-if muted">Without ${n.label} …</div>`:D`<div class="what-if"><b>${n.label}:</b> ${n.words.replace("->","→")}</div>`}var Kg=null,US=0,bu=new Map;function Xf(n,e=!1){let t=Lt.value,i=wt.value;if(clearTimeout(US),!i||!t.suspicious[n]&&!e||t.state[n]!=="active")return;let s=t.id[n],r=`${i.revision}:${s}`,o=`${ms(t,n)} (${So(t,n)})`;if(bu.has(r)){bo.value=bu.get(r);return}US=setTimeout(async()=>{Kg?.abort(),Kg=new AbortController,bo.value={id:s,label:o,revision:i.revision};try{let a=await ls("api/what-if",{observation:s},Kg.signal),l=a.words??`σ₀ ${Ft(a.sigma0,3)}, dof ${a.dof}, largest move ${a.largest?`${a.largest.name} ${Zi(a.largest.moved,"m","")}`:"none"}`,c={id:s,label:o,revision:i.revision,...a,words:l};bu.set(r,c),bu.size>500&&bu.clear(),bo.value=c}catch(a){a.name!=="AbortError"&&(bo.value={id:s,label:o,revision:i.revision,words:a.message})}},140)}function zS({does:n}){let e=Gr(null),[t,i]=ei({top:0,height:400,width:0}),s=Lt.value,r=fa.value,o=Ue.value?.angle??"gon",a=!!wt.value;Z0(()=>{let p=e.current,x=()=>i({top:p.scrollTop,height:p.clientHeight,width:p.clientWidth});x(),p.addEventListener("scroll",x,{passive:!0});let T=new ResizeObserver(x);return T.observe(p),()=>{p.removeEventListener("scroll",x),T.disconnect()}},[]);let{lines:l,width:c}=q3(t.width),u=OS+(l.length-1)*FS+(l.length>1?3:0),h=Vt.value?.type==="row"?Vt.value.id:null;ur(()=>{if(!h)return;let p=r.findIndex(b=>s.id[b]===h);if(p<0)return;let x=e.current,T=p*u;(T<x.scrollTop||T>x.scrollTop+x.clientHeight-2*u)&&(x.scrollTop=Math.max(0,T-x.clientHeight/3))},[h]);let{first:d,last:f}=m_(t.top,t.height,u,r.length),m=[];for(let p=d;p<f;p++)m.push(D`<${Q3} key=${r[p]} i=${r[p]} at=${p} o=${s} angle=${o} does=${n} live=${a} lines=${l} width=${c} height=${u} />`);let y=p=>{let x=h===null?-1:r.findIndex(b=>s.id[b]===h&&(Vt.value.row===void 0||b===Vt.value.row)),T=b=>{let R=Math.min(r.length-1,Math.max(0,b));r.length&&n.row(r[R],R,{}),p.preventDefault()};p.key==="ArrowDown"?T(x+1):p.key==="ArrowUp"?T(x-1):p.key==="PageDown"?T(x+Math.floor(t.height/u)):p.key==="PageUp"?T(x-Math.floor(t.height/u)):p.key==="Home"?T(0):p.key==="End"?T(r.length-1):(p.key==="Enter"||p.key==="x")&&a&&Ii.value.size&&(n.use([...Ii.value]),p.preventDefault())},g=Ii.value.size;return D`<div class="panel observations">
    <${Z3} />
    <${J3} />
    <div class=${`grid ${Ks.value?"stale":""}`} ref=${e} role="grid" aria-rowcount=${r.length+1} aria-label="Observations" tabindex="0" onKeyDown=${y}>
      <${K3} lines=${l} width=${c} />
      <div class="rows" role="rowgroup" style=${{height:`${r.length*u}px`,width:`${c}px`}}>${m}</div>
      ${!r.length&&D`<p class="empty">No observation passes these filters.</p>`}
    </div>
    <div class="foot" hidden=${!a&&!g}>
      ${Ks.value&&a?D`<span class="muted">Values are adjusted; tests are on their way …</span>`:D`<${eI} />`}
      ${g>0&&D`<span class="foot-tools">
        ${a&&D`<button type="button" class="button" onClick=${()=>n.use([...Ii.value])}>Off, check or on …</button>`}
        <button type="button" class="button plain" onClick=${n.rowLink}>Link</button></span>`}
    </div>
  </div>`}var VS=n=>n?[0,1,2].map(e=>Math.sqrt(Math.max(0,n[e][e]))):[null,null,null],Mo=()=>(Ue.value.axes??["E","N","U"]).map(n=>String(n).toUpperCase());function HS({table:n}){return D`<p class="links"><a href=${`tables/${n}.csv`} download>CSV</a> <a href=${`tables/${n}.json`} target="_blank" rel="noopener">JSON</a></p>`}function e0({role:n}){return D`<i class="dot" style=${{background:(as[n]??as.free).colour}}></i>`}function $S({does:n}){let[e,t]=ei(""),i=wt.value,s=e.toLowerCase(),r=yn.value.filter(h=>h.name.toLowerCase().includes(s)),o=Di.value.filter(h=>h.name.toLowerCase().includes(s)&&h.kind==="scanner"),[a,l,c]=Mo(),u=(h,d)=>D`<tr key=${`${d}${h.name}`} class=${Vt.value?.name===h.name?"picked":""} onClick=${()=>n.select({type:d,name:h.name},{stay:!0})} onDblClick=${()=>n.visit(h.name)}>
    <td><button type="button" class="name"><${e0} role=${h.role} />${h.name}</button></td>
    <td>${d==="station"?h.kind:i&&h.role!==void 0?D`<button type="button" class="button plain tiny" title="Change the role" onClick=${f=>{f.stopPropagation(),Li.value={type:"role",name:h.name}}}>${h.role}</button>`:h.role}</td>
    ${(h.xyz??[null,null,null]).map((f,m)=>D`<td class="number" key=${m}>${ai(f)}</td>`)}
    ${VS(h.covariance).map((f,m)=>D`<td class="number" key=${m}>${xt(f)}</td>`)}</tr>`;return D`<div class="panel scroll">
    <div class="filters"><input type="search" placeholder="Find a point" aria-label="Find a point" value=${e} onInput=${h=>t(h.currentTarget.value)} />
      <span class="found">${Gt(r.length)} points, ${Gt(o.length)} scanner stations</span><${HS} table="points" /></div>
    <table class="plain-table"><thead><tr><th>Name</th><th>Role</th><th class="number">${a} [m]</th><th class="number">${l} [m]</th><th class="number">${c} [m]</th>
      <th class="number">σ${a} [mm]</th><th class="number">σ${l} [mm]</th><th class="number">σ${c} [mm]</th></tr></thead>
      <tbody>${r.slice(0,1500).map(h=>u(h,"point"))}${o.slice(0,500).map(h=>u(h,"station"))}</tbody></table>
    ${r.length>1500&&D`<p class="muted small">1 500 of ${Gt(r.length)} points are listed; find the others by name, or take the CSV.</p>`}
  </div>`}function t0({at:n}){let e=Ue.value.targets,t=wt.value,i=e.words?.[n]??{},s=e.accepted&&!e.accepted[n],r=o=>()=>Li.value={type:"target",at:n,reject:o};return D`<article class=${`target ${s?"off":""}`}>
    ${e.picture?.[n]?D`<img src=${e.picture[n]} alt=${`Scan around ${e.name[n]||"the target"}, seen from ${e.scan[n]}`} loading="lazy" width="120" height="120" />`:D`<div class="no-picture">no picture</div>`}
    <div class="grow"><header><b>${e.name[n]||`number ${e.number[n]}`}</b> <span class="muted">${Bi(e.kind[n])} in ${e.scan[n]}</span>${s&&D` <span class="tag bad">rejected</span>`}</header>
      <dl class="facts"><dt>σ along the scanner's axes</dt><dd>${i.sigma??e.sigma[n].map(o=>xt(o)).join(", ")}</dd>
        <dt>rms of the fit</dt><dd>${i.rms??Zi(e.rms[n],"m","")}</dd><dt>points</dt><dd>${Gt(e.points[n])}</dd>
        <dt>range</dt><dd>${i.range??`${ai(e.range[n])} m`}</dd><dt>incidence</dt><dd>${i.incidence??rf(e.incidence[n])}</dd>
        <dt>coverage</dt><dd>${i.coverage??Ft(e.coverage[n])}</dd></dl>
      ${e.remark[n]&&D`<p class="small warn-text">${e.remark[n]}</p>`}
      ${t&&D`<p class="card-tools">${s?D`<button type="button" class="button plain tiny" onClick=${r(!1)}>Take back</button>`:D`<button type="button" class="button plain tiny" onClick=${r(!1)}>Rename, confirm</button>
        <button type="button" class="button plain tiny" onClick=${r(!0)}>Reject</button>`}</p>`}
    </div></article>`}function GS({at:n}){let e=Ue.value.rejected;return D`<article class="target off">${e.picture?.[n]?D`<img src=${e.picture[n]} alt=${`Scan around a rejected candidate, seen from ${e.scan[n]}`} loading="lazy" width="120" height="120" />`:D`<div class="no-picture">no picture</div>`}
    <div class="grow"><header><b>${Bi(e.kind[n])}</b> <span class="muted">candidate in ${e.scan[n]}</span></header><p>${e.reason[n]}</p></div></article>`}function WS(){let[n,e]=ei(""),t=Ue.value.targets,i=Ue.value.rejected,s=t?.scan?.length??0,r=n.toLowerCase(),o=[...Array(s).keys()].filter(c=>`${t.name[c]} ${t.scan[c]} ${t.kind[c]} ${t.remark[c]}`.toLowerCase().includes(r)),a=o.filter(c=>t.accepted&&!t.accepted[c]).length,l=[...Array(i?.scan?.length??0).keys()].filter(c=>`${i.scan[c]} ${i.kind[c]} ${i.reason[c]}`.toLowerCase().includes(r));return D`<div class="panel scroll">
    <div class="filters"><input type="search" placeholder="Find a target, a scan" aria-label="Find a target" value=${n} onInput=${c=>e(c.currentTarget.value)} />
      <span class="found">${Gt(o.length)} found targets${a?`, ${Gt(a)} of them rejected`:""}; ${Gt(l.length)} rejected candidates</span><${HS} table="targets" /></div>
    ${o.slice(0,200).map(c=>D`<${t0} key=${c} at=${c} />`)}
    ${o.length>200&&D`<p class="muted small">200 of ${Gt(o.length)} are shown; find the others by name.</p>`}
    ${l.length>0&&D`<h3>Rejected candidates</h3>${l.slice(0,200).map(c=>D`<${GS} key=${c} at=${c} />`)}`}
    ${!s&&!l.length&&D`<p class="empty">No targets were looked for in scans.</p>`}
  </div>`}function tI(n){let e=Ue.value.targets,t=(e?.scan??[]).findIndex((i,s)=>i===n.scan&&ri(e.center[s].map((r,o)=>r-(n.center?.[o]??NaN)))<.001);return t>=0&&e.name[t]?`${e.name[t]} `:""}var nI=n=>{if(n.observation){let e=Lt.value,t=e.id.indexOf(n.observation);return`${t<0?n.observation:`${ms(e,t)}, ${Bi(e.kind[t])}`}: ${n.use==="active"?"on":n.use}`}return n.point?`point ${n.point}: ${n.role}`:n.scan?`target ${tI(n)}at ${(n.center??[]).map(e=>ai(e,2)).join(", ")} of ${n.scan}: ${n.accept===!1?"rejected":n.name?`is ${n.name}`:"confirmed"}`:JSON.stringify(n)};function iI({does:n}){let e=Ue.value.epochs??[];if(!e.length)return null;let t=Math.min(ef.value,e.length-1),i=e[t];return D`<h3>Displacements ${e.length===1?`from ${i.first} to ${i.second}`:""}</h3>
    ${e.length>1&&D`<div class="filters"><select aria-label="Epochs" value=${t} onChange=${s=>ef.value=Number(s.currentTarget.value)}>${e.map((s,r)=>D`<option key=${r} value=${r} selected=${r===t}>${s.first} to ${s.second}</option>`)}</select></div>`}
    ${i.sentences.slice(0,3).map((s,r)=>D`<p class="small" key=${r}>${s}</p>`)}
    <table class="plain-table"><thead><tr><th>Name</th>${Mo().map(s=>D`<th class="number" key=${s}>Δ${s} [mm]</th>`)}<th class="number">moved [mm]</th><th class="number">σ [mm]</th><th class="number">test (limit)</th><th class="number" title="found in the hardest direction">detectable [mm]</th><th>verdict</th></tr></thead>
      <tbody>${Rs.value.slice(0,500).map(s=>D`<tr key=${s.name} onClick=${()=>n.visit(s.name)}><td><button type="button" class="name"><i class="dot" style=${{background:hl[s.verdict]?.colour}}></i>${s.name}${s.reference?D` <span class="muted">reference</span>`:""}</button></td>
        ${s.moved.map((r,o)=>D`<td class="number" key=${o}>${xt(r)}</td>`)}<td class="number"><b>${xt(s.long)}</b></td><td class="number">${xt(Bl(s.covariance))}</td>
        <td class="number">${Ft(s.test)} (${Ft(s.limit)})</td><td class="number">${xt(s.detectable)}</td><td>${s.verdict}</td></tr>`)}</tbody></table>`}function sI({does:n}){let e=wt.value,t=["run",...(e.states??[]).filter(h=>h!=="run").map(String)],[i,s]=ei("run"),[r,o]=ei(""),a=String(e.revision),l=Ar.value,c=async()=>{let h={a:i,b:r||a};try{Ar.value={...await ls("api/compare",h),...h},iu("moves",!0)}catch(d){cs(d.message,"error")}},u=(h,d,f)=>D`<select class="state" aria-label=${f} value=${h} onChange=${m=>d(m.currentTarget.value)}>${t.map(m=>D`<option key=${m} value=${m} selected=${h===m}>${ia(m)}</option>`)}</select>`;return D`<h3>Compare two states</h3>
    <div class="filters">${u(i,s,"First state")} with ${u(r||a,o,"Second state")}<button type="button" class="button" onClick=${c}>Compare</button>
      ${l&&D`<button type="button" class="button plain" onClick=${()=>Ar.value=null}>End</button>`}</div>
    ${l&&D`<${rI} both=${l} does=${n} />`}`}function rI({both:n,does:e}){let t=[ia(n.a),ia(n.b)],i=[n.sigma0?.a??{},n.sigma0?.b??{}],s=a=>{let l=a.global_test;return l?.accepted===null||l?.accepted===void 0?"no redundancy":`${l.accepted?"accepted":"rejected"}: ${Ft(l.statistic,1)} in ${Ft(l.lower,1)} to ${Ft(l.upper,1)}`},r=[...n.points??[],...n.stations??[]].filter(a=>a.moved).sort((a,l)=>(l.moved_length??0)-(a.moved_length??0)),o=[...n.points??[],...n.stations??[]].filter(a=>!a.moved).map(a=>a.name);return D`<table class="plain-table sides"><thead><tr><th></th>${t.map((a,l)=>D`<th key=${l}>${a}</th>`)}</tr></thead><tbody>
      <tr><td>σ₀ a posteriori</td>${i.map((a,l)=>D`<td key=${l}>${Ft(a.posterior,4)}</td>`)}</tr>
      <tr><td>degrees of freedom</td>${i.map((a,l)=>D`<td key=${l}>${a.dof??"–"}</td>`)}</tr>
      <tr><td>global test</td>${i.map((a,l)=>D`<td key=${l}>${s(a)}</td>`)}</tr></tbody></table>
    <p class="small">${n.largest?.moved>ji?D`Largest move: <b>${n.largest.name}</b>, ${xt(n.largest.moved)} mm. The picture draws the moves from the first state to the second.`:"No point and no station moves by more than 0.005 mm."}${o.length?` Only in the second state: ${o.join(", ")}.`:""}</p>
    <table class="plain-table"><thead><tr><th>Name</th>${Mo().map(a=>D`<th class="number" key=${a}>Δ${a} [mm]</th>`)}<th class="number">moved [mm]</th><th class="number" title="root of the trace of the covariance">σ first [mm]</th><th class="number">σ second [mm]</th></tr></thead>
      <tbody>${r.slice(0,300).map(a=>D`<tr key=${a.name} onDblClick=${()=>e.visit(a.name)}><td>${a.name}</td>${a.moved.map((l,c)=>D`<td class="number" key=${c}>${xt(l)}</td>`)}<td class="number"><b>${xt(a.moved_length)}</b></td>
        <td class="number">${xt(Bl(a.before))}</td><td class="number">${xt(Bl(a.covariance))}</td></tr>`)}</tbody></table>
    <${oI} columns=${n.observations} tested=${n.tested} />`}function oI({columns:n,tested:e}){if(!n?.id?.length||!e?.a||!e?.b)return D`<p class="muted small">The tests of ${!e?.a&&!e?.b?"these states":e?.a?"the second state":"the first state"} were not computed, because another change came first; test values are not compared.</p>`;let t=Lt.value,i=new Map(t.id.map((a,l)=>[`${a} ${t.component[l]}`,l])),s=a=>{let l=i.get(`${n.id[a]} ${n.component[a]}`);return l===void 0?`${n.id[a]} ${n.component[a]}`:`${ms(t,l)}, ${So(t,l)}`},r=a=>(n.state_a[a]!==n.state_b[a]?1e6:0)+Math.abs((n.w_b[a]??0)-(n.w_a[a]??0)),o=[...n.id.keys()].filter(a=>r(a)>.005).sort((a,l)=>r(l)-r(a)).slice(0,20);return o.length?D`<p class="small">Test values that differ most:</p><table class="plain-table"><thead><tr><th>Observation</th><th>use</th><th class="number">w first</th><th class="number">w second</th></tr></thead><tbody>${o.map(a=>D`<tr key=${a}><td title=${n.id[a]}>${s(a)}</td><td>${n.state_a[a]===n.state_b[a]?n.state_b[a]:`${n.state_a[a]??"not there"} → ${n.state_b[a]??"not there"}`}</td><td class="number">${Ft(n.w_a[a])}</td><td class="number">${Ft(n.w_b[a])}</td></tr>`)}</tbody></table>`:D`<p class="muted small">No test value differs by more than 0.005.</p>`}var Bl=n=>Array.isArray(n)?Math.sqrt(Math.max(0,n[0][0]+n[1][1]+n[2][2])):typeof n=="number"?n:null;function XS({does:n}){let e=wt.value,t=uo.value,i=su.value.filter(s=>s.long>ji);return D`<div class="panel scroll">
    <h3>${t.length===0?"No edits":t.length===1?"One edit":`${t.length} edits`}</h3>
    ${!t.length&&D`<p class="muted">${e?"Switch an observation off in the table, change a role or a target: every decision is listed here with its reason.":"This result was made without edits. To switch observations off, change roles or reject targets, open the project: "}${e?"":D`<code>tribrach workbench PROJECT.toml</code>`}</p>`}
    <ol class="edits">${t.map((s,r)=>D`<li key=${r}><div><b>${nI(s)}</b><br />${s.reason}<br /><span class="muted small" title=${s.observation??""}>${[s.by,s.at?.replace?.("T"," ")].filter(Boolean).join(", ")}</span></div>
      ${s.observation&&D`<button type="button" class="button plain tiny" onClick=${()=>n.select({type:"row",id:s.observation},{tab:"observations"})}>Show</button>`}</li>`)}</ol>
    <${iI} does=${n} />
    ${e&&D`<h3>What moves ${Qm.value}</h3>
      ${i.length?D`<p class="small">Largest: <b>${i[0].name}</b>, ${xt(i[0].long)} mm. <a href="tables/moves.csv" download>CSV</a> <a href="tables/moves.json" target="_blank" rel="noopener">JSON</a></p>
      <table class="plain-table"><thead><tr><th>Name</th>${Mo().map(s=>D`<th class="number" key=${s}>Δ${s} [mm]</th>`)}<th class="number">moved [mm]</th><th class="number" title="root of the trace of the covariance">σ before [mm]</th><th class="number">σ now [mm]</th></tr></thead>
        <tbody>${i.slice(0,500).map(s=>D`<tr key=${s.name} onClick=${()=>n.select({type:s.role==="station"?"station":"point",name:s.name},{stay:!0})} onDblClick=${()=>n.visit(s.name)}>
          <td><button type="button" class="name"><${e0} role=${s.role} />${s.name}</button></td>${s.moved.map((r,o)=>D`<td class="number" key=${o}>${xt(r)}</td>`)}<td class="number"><b>${xt(s.long)}</b></td>
          <td class="number">${xt(Bl(s.before))}</td><td class="number">${xt(Bl(s.covariance))}</td></tr>`)}</tbody></table>`:D`<p class="muted">Nothing has moved.</p>`}
      <${sI} does=${n} />`}
  </div>`}function qS(){let n=Ue.value,e=vl.value,t=e.global_test;return D`<div class="panel scroll">
    <h3>The network</h3>
    <dl class="facts wide"><dt>Datum</dt><dd>${n.datum}</dd><dt>σ₀ a priori, a posteriori</dt><dd>${Ft(e.prior,3)}, ${Ft(e.posterior,4)}</dd>
      <dt>Degrees of freedom</dt><dd>${e.dof}</dd>
      ${t&&D`<dt>Global test</dt><dd>${t.accepted?"accepted":"rejected"}: ${Ft(t.statistic,1)}, limits ${Ft(t.lower,1)} to ${Ft(t.upper,1)}</dd>`}
      <dt>Sigmas</dt><dd>${n.covariances==="posterior"?"scaled a posteriori":"a priori"}${n.sigmas_of?`; ${n.sigmas_of}`:""}</dd>
      <dt>Coordinates</dt><dd>${n.crs?"in the CRS of the project":"local"}; drawn about ${n.origin.join(", ")}</dd><dt>Program</dt><dd>Tribrach ${n.tribrach}</dd></dl>
    <h3>${ho.value.length} ${ho.value.length===1?"warning":"warnings"}</h3>
    <ul class="warnings">${ho.value.map((i,s)=>D`<li key=${s}>${i}</li>`)}</ul>
    ${(n.comparisons??[]).length>0&&D`<h3>Comparisons</h3>${n.comparisons.map((i,s)=>D`<${aI} key=${s} c=${i} />`)}`}
  </div>`}function aI({c:n}){return D`<p><b>${n.a}</b> with <b>${n.b}</b></p><ul class="warnings plainer">${(n.sentences??[]).map((e,t)=>D`<li key=${t}>${e}</li>`)}</ul>
    <table class="plain-table"><thead><tr><th>Site</th><th class="number">points</th><th class="number">range [m]</th><th class="number">M3C2 mean [mm]</th><th class="number">observed σ [mm]</th><th class="number">predicted σ [mm]</th></tr></thead>
    <tbody>${(n.sites??[]).map(e=>D`<tr key=${e.name}><td>${e.name}</td><td class="number">${Gt(e.n)}</td><td class="number">${ai(e.range,2)}</td>
      <td class="number">${xt(e.m3c2?.mean)}</td><td class="number">${xt(e.prediction?.observed)}</td><td class="number">${xt(e.predicted_sigma)}</td></tr>`)}</tbody></table>`}function YS({m:n,title:e="3 × 3 [mm²]"}){return n?D`<table class="matrix"><caption>${e}</caption><tbody>${n.map((t,i)=>D`<tr key=${i}>${t.map((s,r)=>D`<td key=${r}>${Ft(s*1e6,3)}</td>`)}</tr>`)}</tbody></table>`:null}function jS({covariance:n,names:e=Mo()}){if(!n)return D`<p class="muted">It has no covariance: fixed or not estimated.</p>`;let{values:t}=Kc(n);return D`<dl class="facts">${VS(n).map((i,s)=>D`<dt key=${s}>σ ${e[s]}</dt><dd>${xt(i)} mm</dd>`)}<dt>σ of position</dt><dd>${xt(Bl(n))} mm</dd>
    <dt>principal σ</dt><dd>${t.map(i=>xt(Math.sqrt(Math.max(0,i)))).join(", ")} mm</dd></dl><${YS} m=${n} />`}function lI({name:n,type:e,does:t}){let i=(e==="station"?Di.value:yn.value).find(l=>l.name===n)??Di.value.find(l=>l.name===n);if(!i)return D`<p class="muted">There is no point of this name.</p>`;let s=Lt.value,r=[];for(let l=0;l<s.id.length&&r.length<200;l++)(s.from[l]===n||s.to[l]===n)&&r.push(l);r.sort((l,c)=>Math.abs(s.w[c]??0)-Math.abs(s.w[l]??0));let o=Ue.value.targets,a=[...Array(o?.scan?.length??0).keys()].filter(l=>o.name[l]===n);return D`<h2><${e0} role=${i.role} />${n} <span class="muted">${i.role==="station"?i.kind:`${i.role} point`}</span></h2>
    <p class="card-tools"><button type="button" class="button" onClick=${()=>t.visit(n)}>Go there</button>
      <button type="button" class="button" onClick=${()=>t.measureFrom({name:n})}>Measure from here</button>
      <button type="button" class="button" onClick=${()=>(In.value={...In.value,station:n,text:"",kind:"",state:""},pi.value="observations")}>Its observations</button>
      ${wt.value&&e==="point"&&D`<button type="button" class="button" onClick=${()=>Li.value={type:"role",name:n}}>Role …</button>`}</p>
    <h3>Coordinates</h3>
    ${(i.words??[]).some(([,l])=>l)?D`<dl class="facts wide">${i.words.filter(([,l])=>l).map(([l,c])=>D`<dt key=${l}>${l}</dt><dd>${[c].flat().join(", ")}</dd>`)}</dl>`:D`<p>${(i.xyz??[]).map(l=>ai(l)).join(", ")} m</p>`}
    ${i.moved&&ri(i.moved)>ji&&D`<p class="small">Now ${i.xyz.map(l=>ai(l)).join(", ")} m: moved ${xt(ri(i.moved))} mm ${Qm.value}.</p>`}
    <h3>Uncertainty</h3><${jS} covariance=${i.covariance} />
    ${i.full&&D`<p class="small muted">σ of the rotations: ${[3,4,5].map(l=>Zi(Math.sqrt(Math.max(0,i.full[l][l])),"rad",Ue.value.angle)).join(", ")}</p>`}
    ${a.length>0&&D`<h3>Seen in ${a.length} ${a.length===1?"scan":"scans"}</h3>${a.map(l=>D`<${t0} key=${l} at=${l} />`)}`}
    <h3>Observations</h3><${n0} list=${r} does=${t} />`}function cI({name:n}){let e=(Ue.value.comparisons??[]).flatMap(t=>(t.sites??[]).filter(i=>i.name===n).map(i=>[t,i]));return D`<h2>Site ${n}</h2>${e.map(([t,i],s)=>{let r=i.prediction;return D`<h3 key=${s}>${t.a} with ${t.b}</h3><dl class="facts wide"><dt>points</dt><dd>${Gt(i.n)}</dd><dt>range</dt><dd>${ai(i.range,2)} m</dd>
      <dt>incidence</dt><dd>${rf(i.incidence)}</dd><dt>mean distance along normals</dt><dd>${xt(i.m3c2?.mean)} mm</dd>
      ${r&&D`<dt>σ observed, predicted</dt><dd>${xt(r.observed)}, ${xt(r.sigma)} mm</dd><dt>offset</dt><dd>${xt(r.offset)} mm, σ ${xt(r.offset_sigma)} mm</dd>`}</dl>
      ${r?.verdict&&D`<p>${r.verdict}</p>`}`})}`}function uI({o:n,i:e}){let t=s=>Qg(n,e,s,Ue.value.angle),i={active:"on",check:"check",off:"off"}[n.state[e]]??n.state[e];return D`<dl class="facts wide"><dt>Source</dt><dd>${n.source[e]}</dd><dt>Use</dt><dd>${i}${n.reason?.[e]?`: ${n.reason[e]}`:""}</dd>
    <dt>Value</dt><dd>${t("value")}</dd><dt>σ</dt><dd>${t("sigma")}</dd><dt>Residual v</dt><dd>${t("residual")}</dd>
    <dt>Normalised residual w</dt><dd>${t("w")}</dd><dt>Redundancy number r</dt><dd>${t("redundancy")}</dd>
    <dt>Minimal detectable bias</dt><dd>${t("mdb")}</dd><dt>Its largest effect</dt><dd>${t("external")}</dd></dl>`}function n0({list:n,does:e}){let t=Lt.value;return n.length?D`<table class="plain-table"><tbody>${n.slice(0,12).map(i=>D`<tr key=${i} class=${`${t.suspicious[i]?"suspicious":""} is-${t.state[i]}`} onClick=${()=>e.select({type:"row",id:t.id[i],row:i},{tab:"observations"})}>
    <td><button type="button" class="name">${ms(t,i)}</button></td><td>${So(t,i)}</td><td class="number">${Zi(t.residual[i],t.unit[i],Ue.value.angle)}</td><td class="number">w ${Ft(t.w[i])}</td></tr>`)}</tbody></table>
    ${n.length>12&&D`<p class="muted small">and ${n.length-12} more</p>`}`:D`<p class="muted">None.</p>`}function hI({item:n,does:e}){let t=[...n.rows].sort((i,s)=>Math.abs(Lt.value.w[s]??0)-Math.abs(Lt.value.w[i]??0));return D`<h2>${n.names[0]} → ${n.names[1]}</h2><p class="muted">${t.length} observed ${t.length===1?"value":"values"}, ${ai(ri(n.from.map((i,s)=>i-n.to[s])),3)} m apart</p><${n0} list=${t} does=${e} />`}function dI({item:n}){let e=n.edge;return D`<h2>${e.first} with ${e.second}</h2><dl class="facts"><dt>by</dt><dd>${Bi(e.kind)}, ${e.count}</dd><dt>rms</dt><dd>${Zi(e.rms,"m","")}</dd>
    <dt>off by</dt><dd>${Zi(e.shift,"m","")} (σ ${Zi(e.shift_sigma,"m","")})</dd><dt>turned by</dt><dd>${Zi(e.turn,"rad",Ue.value.angle)} (σ ${Zi(e.turn_sigma,"rad",Ue.value.angle)})</dd>
    <dt>statistic</dt><dd>${Ft(e.statistic,2)}, limit ${Ft(e.limit,1)}</dd></dl><p>${e.outlying?"This link is beyond its limit.":"This link is within its limit."}</p>`}function fI({parts:n}){let e=Math.max(...n.map(t=>t.sigma??0),1e-12);return D`<div class="budget">${n.map(t=>D`<div key=${t.part} class="budget-row"><span>${Bi(t.part)}</span><span class="bar"><i style=${{width:`${100*(t.sigma??0)/e}%`}}></i></span><span class="number">${xt(t.sigma)} mm</span></div>`)}</div>`}function pI({point:n,does:e}){let{distance:t,level:i}=n;return D`<h2>Point of ${n.cloud.replace(/^\+/,"")}</h2>
    <p class="card-tools"><button type="button" class="button" onClick=${()=>e.measureFrom({point:n})}>Measure from here</button></p>
    <h3>Coordinates</h3><dl class="facts wide"><dt>${Mo().join(", ")}</dt><dd>${n.xyz.map(s=>ai(s)).join(", ")} m</dd></dl>
    ${t!==null&&D`<h3>Distance of the compared clouds</h3><dl class="facts"><dt>distance</dt><dd>${xt(t)} mm</dd>
      ${i!==null&&D`<dt>level of detection</dt><dd>${xt(i)} mm (95 %)</dd>`}</dl>
      ${i!==null&&D`<p>${Math.abs(t)>i?"It is beyond its level of detection.":"It is within its level of detection: no change can be told here."}</p>`}`}
    <p class="muted small">This cloud was given besides those of the run; the run knows no sigmas of its points.</p>`}function mI({point:n,does:e}){let t=n.more,i=Object.entries(t?.frames??{});return n.further?D`<${pI} point=${n} does=${e} />`:D`<h2>Point of ${n.cloud}</h2>
    <p class="card-tools"><button type="button" class="button" onClick=${()=>e.measureFrom({point:n})}>Measure from here</button></p>
    <h3>Coordinates</h3><dl class="facts wide">${i.length?i.map(([s,r])=>D`<dt key=${s}>${s}</dt><dd>${[r].flat().map(o=>typeof o=="number"?ai(o):o).join(", ")}</dd>`):D`<dt>${Mo().join(", ")}</dt><dd>${n.xyz.map(s=>ai(s)).join(", ")} m</dd>`}</dl>
    <h3>Seen from ${t?.station??n.station}</h3><dl class="facts"><dt>range</dt><dd>${t?.range!==void 0&&t?.range!==null?`${ai(t.range,3)} m`:n.range!==null?`${ai(n.range,3)} m`:"–"}</dd>
      <dt>incidence</dt><dd>${n.incidence!==null?`${n.incidence.toFixed(1)}°`:rf(t?.incidence)}</dd><dt>intensity</dt><dd>${Gt(n.intensity)}</dd></dl>
    <h3>Uncertainty <span class="muted">${wt.value?"of the last run":""}</span></h3>
    ${t?.covariance?D`<${jS} covariance=${t.covariance} />`:n.sigma?D`<dl class="facts">${n.sigma.map((s,r)=>D`<dt key=${r}>σ ${Mo()[r]}</dt><dd>${xt(s)} mm</dd>`)}<dt>σ of position</dt><dd>${xt(ri(n.sigma))} mm</dd></dl>`:D`<p class="muted">This cloud carries no sigmas.</p>`}
    ${t?.budget?.length?D`<h3>What it is made of</h3><${fI} parts=${t.budget} />`:""}
    ${t?.words?.note&&D`<p class="small">${t.words.note}</p>`}
    ${n.asking&&D`<p class="muted small">The program is asked for the full covariance …</p>`}
    ${n.without&&D`<p class="muted small">${n.without}</p>`}`}function ZS({does:n}){let e=Vt.value,t=Cs.value,i=t?D`<div class="card inset"><h2>Distance</h2><p>${t.from} to ${t.to}</p>
    <p class="big">${t.words??`${ai(t.distance)} m`}</p>${!t.words&&t.sigma!==void 0&&t.sigma!==null&&D`<p>σ ${xt(t.sigma)} mm</p>`}${t.note&&D`<p class="muted small">${t.note}</p>`}
    ${t.covariance&&D`<${YS} m=${t.covariance} title="Covariance of the difference [mm²]" />`}
    <p class="card-tools"><button type="button" class="button plain" onClick=${n.noMeasure}>Clear</button></p></div>`:null,s;if(!e)s=D`<p class="empty">Pick a point, a target, a station, a line or a point of the cloud in the picture.</p>`;else if(e.type==="cloud")s=D`<${mI} point=${e.point} does=${n} />`;else if(e.type==="ray")s=D`<${hI} item=${e.item} does=${n} />`;else if(e.type==="edge")s=D`<${dI} item=${e.item} />`;else if(e.type==="rejected")s=D`<h2>Rejected candidate</h2><${GS} at=${e.at} />`;else if(e.type==="turnedDown")s=D`<h2>Rejected target</h2><${t0} at=${e.at} />`;else if(e.type==="site")s=D`<${cI} name=${e.name} />`;else if(e.type==="row"){let r=Lt.value;s=D`<h2>${ms(r,e.row)}</h2><p>${So(r,e.row)}</p><${uI} o=${r} i=${e.row} /><h3>All values of this observation</h3><${n0} list=${[...r.id.keys()].filter(o=>r.id[o]===e.id)} does=${n} />`}else s=D`<${lI} name=${e.name} type=${e.type} does=${n} />`;return D`<div class="panel scroll selection">${i}${s}</div>`}function qf({title:n,children:e,submit:t,ready:i,action:s}){let r=Gr(null);ur(()=>{r.current.showModal()},[]);let o=()=>Li.value=null;return D`<dialog ref=${r} class="dialog" onClose=${o} onCancel=${o}>
    <form method="dialog" onSubmit=${a=>{a.preventDefault(),i&&t()}}>
      <h2>${n}</h2>
      ${e}
      <div class="dialog-foot"><button type="button" class="button" onClick=${o}>Cancel</button>
        <button type="submit" class="button primary" disabled=${!i}>${s}</button></div>
    </form></dialog>`}function i0({reason:n,set:e,example:t="prism tilted, see field book page 12"}){return D`<label class="stack"><span>Reason <span class="muted">(is kept with the decision and stands in the report)</span></span>
    <textarea rows="2" maxlength="400" autofocus required value=${n} onInput=${i=>e(i.currentTarget.value)} placeholder=${`for example: ${t}`}></textarea></label>`}function gI({ids:n}){let e=Lt.value,t=n.map(u=>e.id.indexOf(u)).filter(u=>u>=0),i=new Set(t.map(u=>e.state[u])),[s,r]=ei(i.has("active")?"off":"active"),[o,a]=ei("");ur(()=>{t.length===1&&Xf(t[0],!0)},[]);let l=bo.value?.id===n[0]&&n.length===1?bo.value:null,c=()=>{Li.value=null,er("api/edits",{changes:n.map(u=>({do:"use",observation:u,use:s,reason:o.trim()}))})};return D`<${qf} title=${n.length===1?`${ms(e,t[0])}, ${Bi(e.kind[t[0]])}`:`${n.length} observations`} submit=${c} ready=${!!o.trim()} action="Adjust again">
    ${n.length===1&&D`<p class="muted small">${e.source[t[0]]}${e.reason?.[t[0]]?` · now: ${e.reason[t[0]]}`:""}</p>`}
    <fieldset class="choices"><legend class="sr">Use</legend>
      ${[["active","On","takes part in the adjustment"],["check","Check","is compared with the result, does not pull on it"],["off","Off","is left out"]].map(([u,h,d])=>D`<label key=${u} class=${s===u?"choice chosen":"choice"}>
        <input type="radio" name="use" value=${u} checked=${s===u} onChange=${()=>r(u)} /><span><b>${h}</b><br /><span class="muted">${d}</span></span></label>`)}
    </fieldset>
    ${l?.words&&s==="off"&&D`<p class="note">${l.words}</p>`}
    <${i0} reason=${o} set=${a} />
  <//>`}function _I({name:n}){let e=yn.value.find(a=>a.name===n),[t,i]=ei(e.role==="control"?"check":"control"),[s,r]=ei(""),o=()=>{Li.value=null,er("api/edits",{changes:[{do:"role",point:n,role:t,reason:s.trim()}]})};return D`<${qf} title=${`Role of ${n}`} submit=${o} ready=${!!s.trim()&&t!==e.role} action="Adjust again">
    <fieldset class="choices"><legend class="sr">Role</legend>
      ${[["control","Control","its given coordinates take part"],["check","Check","its given coordinates are only compared"],["free","Free","its given coordinates are left out"]].map(([a,l,c])=>D`<label key=${a} class=${t===a?"choice chosen":"choice"}>
        <input type="radio" name="role" value=${a} checked=${t===a} onChange=${()=>i(a)} /><span><b>${l}</b>${e.role===a?" (now)":""}<br /><span class="muted">${c}</span></span></label>`)}
    </fieldset><${i0} reason=${s} set=${r} /><//>`}function vI({at:n,reject:e}){let t=Ue.value.targets,[i,s]=ei(t.name[n]??""),r=t.accepted&&!t.accepted[n],[o,a]=ei(!e),[l,c]=ei(""),u=()=>{Li.value=null,er("api/edits",{changes:[{do:"target",scan:t.scan[n],number:t.number[n],name:r&&i.trim()===t.name[n]?null:i.trim()||null,accept:o,reason:l.trim()}]})};return D`<${qf} title=${`${r?"Take back":e?"Reject":"Target"} ${t.name[n]||`number ${t.number[n]}`}, ${t.scan[n]}`} submit=${u} ready=${!!l.trim()} action="Adjust again">
    <p class="muted small">${Bi(t.kind[n])}${t.remark[n]?`, ${t.remark[n]}`:""}</p>
    <fieldset class="choices two"><legend class="sr">Decision</legend>
      <label class=${o?"choice chosen":"choice"}><input type="radio" name="accept" checked=${o} onChange=${()=>a(!0)} /><span><b>It is a target</b></span></label>
      <label class=${o?"choice":"choice chosen"}><input type="radio" name="accept" checked=${!o} onChange=${()=>a(!1)} /><span><b>It is none</b></span></label>
    </fieldset>
    ${o&&D`<label class="stack"><span>Name of the point</span><input type="text" maxlength="200" value=${i} onInput=${h=>s(h.currentTarget.value)} list="point-names" /></label>
      <datalist id="point-names">${yn.value.map(h=>D`<option key=${h.name} value=${h.name}></option>`)}</datalist>`}
    <${i0} reason=${l} set=${c} example=${o?"label read in the photograph of the set-up":"a reflection, no target stood there"} /><//>`}function JS(){let n=Li.value;return n?n.type==="use"?D`<${gI} ids=${n.ids} />`:n.type==="role"?D`<${_I} name=${n.name} />`:n.type==="target"?D`<${vI} at=${n.at} reject=${n.reject} />`:n.type==="keys"?D`<${yI} />`:null:null}function yI(){return D`<${qf} title="Keys and pointer" submit=${()=>Li.value=null} ready=${!0} action="Close"><dl class="keys">${[["drag","turn about the point under the pointer (parallel views: move; Ctrl turns)"],["Shift or right button","move"],["wheel","nearer or farther, towards the pointer"],["double click","go there"],["R, F","first view; everything"],["P, 1 to 5","perspective or parallel; plan and elevations"],["M","measure a distance"],["Escape","end a tool, clear the selection"],["arrows in the table","next row; Enter or X: off, check or on"],["Ctrl+Z, Ctrl+Shift+Z, Ctrl+S","undo, redo, save"]].map(([e,t])=>D`<dt key=${e}>${e}</dt><dd>${t}</dd>`)}</dl><//>`}var pe=null,Ur=null,kl=[["observations","Observations"],["points","Points"],["targets","Targets"],["changes","Changes"],["notes","Notes"],["selection","Selection"]];function wo(n){return yn.value.find(e=>e.name===n)?.xyz??Rs.value.find(e=>e.name===n)?.from??Di.value.find(e=>e.name===n)?.xyz??null}async function xI(n){let e=Di.value.find(s=>s.name===n.station),t=e?.posed?.slice(0,3).map(s=>s[3])??e?.xyz;t?n.range=ri(n.xyz.map((s,r)=>s-t[r])):n.range=null;let i=s=>{(Vt.value?.point===n||Vt.value?.point?.key===n.key)&&(Vt.value={type:"cloud",point:{...Vt.value.point,...s}})};n.key=`${n.cloud}:${n.node}:${n.index}`;try{let s=await ls("api/point",{cloud:n.cloud,x:n.xyz[0],y:n.xyz[1],z:n.xyz[2],node:n.node,index:n.index});i({more:s,asking:!1})}catch(s){i({asking:!1,without:s.status===404?"The full covariance and the error budget need the program: tribrach view.":s.message})}}function Yf(n,e={}){if(Pi.value==="measure"&&(n?.type==="point"||n?.type==="station")){a0({name:n.name});return}ys(()=>{if(n?.type==="row"){let t=n.row??Lt.value.id.indexOf(n.id);Vt.value={type:"row",id:n.id,row:t},Ii.value=new Set([n.id]),fa.value.includes(t)||(In.value={text:"",station:"",kind:"",state:"",low:null,high:null})}else Vt.value=n;e.tab?pi.value=e.tab:n&&!e.stay&&(pi.value=n.type==="row"?"observations":"selection"),n&&!e.stay&&(co.value=!0)})}async function a0(n){let e=Qs.value[0];if(e&&e.name!==void 0&&e.name===n.name){jf(`${n.name} is the first end: choose another point.`);return}let t=[...Qs.value,n].slice(-2);if(Qs.value=t,Cs.value=null,t.length<2)return;let i=c=>c.name??`point of ${c.point.cloud}`,s=c=>c.name?wo(c.name):c.point.xyz,r=s(t[1]).map((c,u)=>c-s(t[0])[u]),o=ri(r),a={from:i(t[0]),to:i(t[1]),distance:o,sigma:null};Cs.value=a,pi.value="selection",Pi.value="select";let l=c=>c.name??`${c.point.cloud}:${c.point.xyz.join(",")}`;try{let c=await ls("api/relative",{a:l(t[0]),b:l(t[1])});Cs.value={...a,distance:c.distance,sigma:c.sigma,covariance:c.covariance,words:typeof c.words=="object"?[c.words.distance,c.words.sigma&&`σ ${c.words.sigma}`].filter(Boolean).join(", "):c.words,note:c.words?.note}}catch(c){let u=c.status===404?await bI(t,r,o):null,h=Ue.value.joint?"Here sigmas are known of distances between points and stations; for those of single points of a cloud open the results with tribrach view.":"Its sigma needs the joint covariance: tribrach view.";Cs.value=u?{...a,...u}:{...a,note:c.status===404?h:c.message}}}var s0=null;async function bI(n,e,t){let i=Ue.value.joint,s=n.map(r=>r.name===void 0?-1:i?.names.indexOf(r.name)??-1);if(!i||s.some(r=>r<0))return null;s0??=Py(i.file);try{let r=by(await s0,s[0],s[1]),o=e.map(l=>l/t),a=o.reduce((l,c,u)=>l+c*o.reduce((h,d,f)=>h+r[u][f]*d,0),0);return{sigma:Math.sqrt(Math.max(0,a)),covariance:r,note:Ue.value.sigmas_of}}catch(r){return s0=null,{note:r.message}}}function jf(n){cs(n)}async function KS(n){try{await navigator.clipboard.writeText(n),jf("The link is copied.")}catch{location.hash=new URL(n).hash,jf("The link stands in the address bar.")}}function QS(){let n=new URL(location.href);return n.hash=ou(),n.href}var Dn={undo:()=>er("api/undo"),redo:()=>er("api/redo"),save:async()=>await er("api/save")&&jf("The decisions are kept in edits.toml."),run:async()=>{Cr.value={what:"Running the project",done:0,total:0},await er("api/run")===null&&(Cr.value=null)},cancel:()=>er("api/cancel"),closeDefect:()=>Js.value=null,link:()=>KS(QS()),rowLink:()=>{let n=new URL(QS()),e=new URLSearchParams(n.hash.slice(1));e.set("tab","observations"),n.hash=e.toString(),KS(n.href)},look:n=>pe?.look(n),home:()=>pe?.home(),fit:()=>pe?.fit(),project:()=>pe?.eye.project(!pe.eye.ortho),open:n=>sf(n,{camera:e=>pe?.eye.restore(e)}),get canSave(){return nu.value},keep:async n=>{try{await Yd("api/views",{name:n,hash:ou()}),ea.value={...ea.value,[n]:ou()}}catch(e){cs(e.status===404?"Views are kept by tribrach view or workbench; copy the link instead.":e.message,"error")}},slice:n=>{if(!n){Jn.value=null;return}let e=pe.slicingBox();Jn.value={on:!0,turn:0,...e}},get upright(){let n=Ue.value.frame;return!n||n.every((e,t)=>e.every((i,s)=>i===(t===s?1:0)))},use:n=>Li.value={type:"use",ids:n},row:(n,e,t)=>{let i=Lt.value,s=i.id[n];if(t.ctrlKey||t.metaKey){let r=new Set(Ii.value);r.has(s)?r.delete(s):r.add(s),Ii.value=r;return}if(t.shiftKey&&Vt.value?.type==="row"){let r=fa.value,o=r.findIndex(l=>i.id[l]===Vt.value.id),a=new Set;for(let l=Math.min(o,e);l<=Math.max(o,e);l++)l>=0&&a.add(i.id[r[l]]);Ii.value=a;return}ys(()=>{Vt.value={type:"row",id:s,row:n},Ii.value=new Set([s])})},hover:n=>Xf(n),visitRow:n=>{let e=Lt.value,[t,i]=[wo(e.from[n]),wo(e.to[n])].map(s=>s&&pe.toDrawing(s));t&&i?pe.visit(t.map((s,r)=>(s+i[r])/2),ri(t.map((s,r)=>s-i[r]))*1.4+4):(t??i)&&pe.visit(t??i)},select:Yf,visit:n=>{let e=wo(n);e&&pe.visit(pe.toDrawing(e))},measureFrom:n=>{Qs.value=[n],Cs.value=null,Pi.value="measure"},endMeasure:()=>{Pi.value="select",Dn.noMeasure()},noMeasure:()=>{Qs.value=[],Cs.value=null}};function SI(){let n=uo.value.length,e=ho.value.length,t={changes:n,notes:e},i=kl.some(([o])=>o===pi.value)?pi.value:"observations",s={observations:()=>D`<${zS} does=${Dn} />`,points:()=>D`<${$S} does=${Dn} />`,targets:()=>D`<${WS} />`,changes:()=>D`<${XS} does=${Dn} />`,notes:()=>D`<${qS} />`,selection:()=>D`<${ZS} does=${Dn} />`}[i],r=o=>{let a=kl.findIndex(([c])=>c===i),l={ArrowRight:1,ArrowLeft:-1}[o.key];l&&(pi.value=kl[(a+l+kl.length)%kl.length][0],o.preventDefault(),requestAnimationFrame(()=>document.getElementById(`tab-${pi.value}`)?.focus()))};return D`<aside class=${`right ${co.value?"":"shut"}`} aria-label="Tables">
    <div class="tabs" role="tablist" onKeyDown=${r}>${kl.map(([o,a])=>D`<button type="button" role="tab" key=${o} id=${`tab-${o}`} aria-selected=${i===o} aria-controls="panel"
      tabindex=${i===o?0:-1} onClick=${()=>pi.value=o}>${a}${t[o]?D`<span class="badge">${t[o]}</span>`:""}</button>`)}</div>
    <div id="panel" role="tabpanel" aria-labelledby=${`tab-${i}`} class="panel-host">${s()}</div>
  </aside>`}function MI(){let n=Gr(null);return ur(()=>TI(n.current),[]),D`<section class="stage" aria-label="Picture">
    <div class="picture-host" ref=${n}></div>
    <div class="stage-tools card" role="toolbar" aria-label="Tools">
      ${[["select","arrow","Select"],["pick","pick","Pick points of the cloud only"],["measure","ruler","Measure a distance (M)"]].map(([t,i,s])=>D`<button type="button" key=${t} class=${`tool ${Pi.value===t?"active":""}`} aria-pressed=${Pi.value===t} title=${s} onClick=${()=>{Pi.value=t,t==="measure"&&Dn.noMeasure()}}><${vi} name=${i} /><span class="sr">${s}</span></button>`)}
      <span class="gap"></span>
      <button type="button" class="tool" title="First view (R)" onClick=${Dn.home}><${vi} name="home" /><span class="sr">First view</span></button>
      <button type="button" class="tool" title="Everything in the picture (F)" onClick=${Dn.fit}><${vi} name="fit" /><span class="sr">Fit all</span></button>
      <button type="button" class="tool" title="Keys and pointer (?)" onClick=${()=>Li.value={type:"keys"}}>?</button>
    </div>
    <${ab} />
    <${ob} colours=${pe?.clouds.stationColours??new Map} ready=${lo.value.total} />
    <div class="tooltip card" id="tooltip" hidden></div>
    <${ib} does=${Dn} />
  </section>`}function wI(){return document.documentElement.dataset.theme=Fi.value,D`<${nb} does=${Dn} />
    <main class="body"><${sb} does=${Dn} colours=${pe?.clouds.stationColours} ready=${lo.value.total} />
      <${MI} /><${EI} /><${SI} /></main><${JS} />`}function EI(){let n=i=>document.documentElement.style.setProperty("--right",`${Math.min(window.innerWidth*.75,Math.max(300,i))}px`);return D`<div class="splitter" role="separator" aria-orientation="vertical" aria-label="Width of the tables" tabindex="0" onPointerDown=${i=>{let s=i.currentTarget;s.setPointerCapture(i.pointerId);let r=a=>n(window.innerWidth-a.clientX),o=()=>s.removeEventListener("pointermove",r);s.addEventListener("pointermove",r),s.addEventListener("pointerup",o,{once:!0}),s.addEventListener("pointercancel",o,{once:!0})}} onKeyDown=${i=>{let s=document.querySelector(".right")?.getBoundingClientRect().width??600;if(i.key==="ArrowLeft")n(s+40);else if(i.key==="ArrowRight")n(s-40);else return;i.preventDefault()}}></div>`}function TI(n){try{pe=new Rf(n,Ue.value,{click:PI,hover:II,camera:()=>{Kd.value=pe?.eye.ortho??!1,RI()},drawn:()=>tM(),loaded:()=>tM(),failed:t=>cs(t,"error"),gone:()=>pl.value=!1,sliced:t=>Jn.value=t})}catch(t){cs(`The picture cannot be drawn: ${t?.message??t}. The tables work without it.`,"error");return}Ur=document.getElementById("tooltip"),ru.value=pe.eye.ball.radius;let e=Number(new URLSearchParams(location.search).get("budget"));Number.isFinite(e)&&e>=1e3&&(_l.value=Math.min(2e7,e)),sf(location.hash,{camera:t=>pe.eye.restore(t)}),sM(),AI(),lo.value={points:0,total:pe.clouds.total,loading:1},window.tribrach=LI()}function sM(){let n=Lr.value;if(ml.value&&(Kn.value==="station"||n.has(Kn.value)||!n.size))return;let e=(Ue.value.clouds??[]).some(t=>t.further&&t.attributes.distance);Kn.value=[...e?["distance"]:[],"sigma_z","sigma","intensity","rgb"].find(t=>n.has(t))??"station"}function AI(){let n=pe.clouds;Yt(()=>n.colour(Kn.value,sa.value)),Yt(()=>{n.shared.uSize.value=ao.value*(window.devicePixelRatio>1?1.5:1),n.shared.uFill.value=gl.value,n.shared.uRound.value=gl.value||ao.value>=4,pe.composite.uniforms.uStrength.value=ta.value,pe.draw()}),Yt(()=>{n.budget=_l.value,n.soon()}),Yt(()=>{for(let t of n.clouds)t.visible=en(`scan:${t.name}`);n.soon(),pe.draw()}),Yt(()=>{let t=new Map(Di.value.map(i=>[i.name,{before:i.posed,now:i.pose}]));(oi.value||Di.value.some(i=>i.posed!==i.pose))&&n.carry(t)}),Yt(()=>{let t=eM(Jn.value),i=[...yn.value,...Di.value.filter(s=>s.kind==="scanner")].filter(s=>s.xyz&&t(s.xyz));pe.network.setEllipsoids(i,Rr.value||xl.value),pe.draw()}),Yt(()=>{let t=eM(Jn.value);pe.network.setRays(nf.value.filter(i=>t(i.from)&&t(i.to)),Fi.value==="dark"),pe.network.show(en),pe.draw()}),Yt(()=>{let t=new Map(Di.value.filter(s=>s.xyz).map(s=>[s.name,s.xyz]));for(let s of yn.value)t.has(s.name)||t.set(s.name,s.xyz);pe.network.setEdges((Ue.value.edges??[]).filter(s=>t.has(s.first)&&t.has(s.second)).map(s=>({edge:s,from:t.get(s.first),to:t.get(s.second),outlying:!!s.outlying})));let i=Ue.value.planes;pe.network.setPlanes((i?.name??[]).map((s,r)=>({name:s,normal:i.normal[r],centre:i.centre[r],extent:i.extent[r],axes:i.axes?.[r],half:i.half?.[r]})).filter(s=>s.centre)),pe.network.show(en),pe.draw()}),Yt(()=>{pe.network.setMoves(na.value.map(t=>({from:t.xyz.map((i,s)=>i-t.moved[s]),moved:t.moved})),Pr.value||yl.value,ji),pe.network.show(en),pe.draw()}),Yt(()=>{pe.network.setEpochs(Rs.value,tf.value),pe.network.show(en),pe.draw()}),Yt(()=>{pe.network.show(en),pe.names=en("names"),pe.marks=CI(),pe.draw()}),Yt(()=>{let t=Vt.value,i=null;if((t?.type==="ray"||t?.type==="edge")&&(i=[[pe.toDrawing(t.item.from),pe.toDrawing(t.item.to)]]),t?.type==="row"){let l=Lt.value,[c,u]=[wo(l.from[t.row]),wo(l.to[t.row])];c&&u&&(i=[[pe.toDrawing(c),pe.toDrawing(u)]])}pe.network.mark(i);let s=[];t?.type==="cloud"&&s.push({at:t.point.draw,text:"",symbol:"ring",colour:"#e81f8c",weight:99,always:!0});let r=t?.type==="row"?[Lt.value.from[t.row],Lt.value.to[t.row]]:t?.name?[t.name]:[];for(let l of r){let c=l&&wo(l);c&&s.push({at:pe.toDrawing(c),text:"",symbol:"ring",colour:"#e0a100",weight:99,always:!0})}let o=Qs.value.map(l=>l.name?pe.toDrawing(wo(l.name)):l.point.draw);pe.measured=o.length===2?[o[0],o[1]]:null;for(let l of o)s.push({at:l,text:"",symbol:"end",colour:"#0b7fab",weight:100,always:!0});let a=Cs.value;if(o.length===2&&a){let l=`${ai(a.distance)} m${a.sigma?` ± ${xt(a.sigma)} mm`:""}`;s.push({at:o[0].map((c,u)=>(c+o[1][u])/2),text:l,symbol:"plate",colour:"#0b7fab",weight:101,strong:!0,always:!0})}pe.notes=s,pe.draw()}),Yt(()=>pe.setSlice(Jn.value)),Yt(()=>pe.theme(Fi.value)),Yt(()=>{pe.only=Pi.value,pe.canvas.classList.toggle("aiming",Pi.value!=="select")});let e=0;Yt(()=>{let t=ou();clearTimeout(e),e=setTimeout(()=>history.replaceState(null,"",`#${t}`),400)})}function eM(n){if(!n?.on)return()=>!0;let[e,t]=[Math.cos(n.turn),Math.sin(n.turn)];return i=>{let[s,r,o]=pe.toDrawing(i).map((a,l)=>a-n.centre[l]);return Math.abs(e*s+t*r)<=n.half[0]&&Math.abs(e*r-t*s)<=n.half[1]&&Math.abs(o)<=n.half[2]}}function CI(){let n=[],e=Vt.value,t=s=>e?.name===s;if(en("stations")){let s=new Set(yn.value.map(r=>r.name));for(let r of Di.value)!r.xyz||r.kind!=="scanner"&&s.has(r.name)||n.push({at:pe.toDrawing(r.xyz),text:r.name,symbol:"square",colour:as.station.colour,weight:60,strong:t(r.name),what:{type:"station",name:r.name}})}if(en("points"))for(let s of yn.value){if(!s.xyz)continue;let r=jm(s.role);n.push({at:pe.toDrawing(s.xyz),text:s.name,symbol:r.symbol,colour:r.colour,weight:(s.role==="control"?80:s.role==="check"?50:40)+(t(s.name)?100:0),strong:t(s.name),small:en("ellipsoids"),what:{type:"point",name:s.name}})}let i=Ue.value.rejected;if(en("rejected")&&i&&i.xyz.forEach((s,r)=>{s&&n.push({at:pe.toDrawing(s),text:"",symbol:"cross",colour:"#8a4b12",weight:10,what:{type:"rejected",at:r}})}),en("rejected")){let s=Ue.value.targets;for(let r of Qd.value)s.xyz[r]&&n.push({at:pe.toDrawing(s.xyz[r]),text:s.name[r],symbol:"cross",colour:"#8a4b12",weight:10,what:{type:"turnedDown",at:r,name:s.name[r]}})}if(en("comparisons"))for(let s of Ue.value.comparisons??[])for(let r of s.sites??[])r.xyz&&n.push({at:pe.toDrawing(r.xyz),text:`site ${r.name}`,symbol:"circle",small:!0,colour:"#0b7fab",weight:20,what:{type:"site",name:r.name}});return n}var r0=0;function tM(){r0||(r0=setTimeout(()=>{r0=0;let n=pe.clouds,e={points:n.shownPoints,total:n.total,loading:n.loading},t=lo.value;(e.points!==t.points||e.total!==t.total||e.loading!==t.loading)&&(lo.value=e)},120))}var nM=0;function RI(){clearTimeout(nM),nM=setTimeout(()=>tu.value=pe.eye.state(),300)}function PI(n){if(Pi.value==="measure"){n?.type==="point"||n?.type==="station"?a0({name:n.name}):n?.type==="cloud"&&a0({point:n.point});return}if(!n){Vt.value=null,Ii.value=new Set;return}if(n.type==="cloud"){let e={...n.point,asking:!n.point.further};Yf({type:"cloud",point:e}),e.asking&&xI(e)}else if(n.type==="ray"){let e=Lt.value,t=[...n.item.rows].sort((i,s)=>Math.abs(e.w[s]??-1)-Math.abs(e.w[i]??-1))[0];t!==void 0&&Yf({type:"row",id:e.id[t],row:t},{tab:"observations"})}else Yf(n.type==="edge"?{type:"edge",item:n.item}:{type:n.type,name:n.name,at:n.at})}function II(n){if(!Ur)return;if(!n){Ur.hidden=!0;return}let e=n.name??"";if(n.type==="ray"){let t=Lt.value,i=[...n.item.rows].sort((s,r)=>Math.abs(t.w[r]??-1)-Math.abs(t.w[s]??-1))[0];e=`${n.item.names[0]} → ${n.item.names[1]}: ${n.item.rows.length} values, largest w ${n.item.w===null?"–":n.item.w.toFixed(2)} (${So(t,i)})`}else if(n.type==="edge")e=`${n.item.edge.first} with ${n.item.edge.second}: ${n.item.edge.count} ${n.item.edge.kind.replaceAll("_"," ")}`;else if(n.type==="turnedDown")e=`${n.name||"target"} of ${Ue.value.targets.scan[n.at]}, rejected: ${Ue.value.targets.remark[n.at]}`;else if(n.type==="rejected")e=`rejected: ${Ue.value.rejected.reason[n.at]}`;else{let t=(n.type==="station"?Di:yn).value.find(i=>i.name===n.name);t?.covariance&&(e=`${t.name}: σ ${[0,1,2].map(i=>(Math.sqrt(Math.max(0,t.covariance[i][i]))*1e3).toFixed(2)).join(", ")} mm`)}Ur.textContent=e,Ur.hidden=!1,Ur.style.left=`${Math.min(n.x+14,pe.eye.width-Ur.offsetWidth-8)}px`,Ur.style.top=`${Math.min(n.y+14,pe.eye.height-Ur.offsetHeight-8)}px`}document.addEventListener("keydown",n=>{if(n.target.closest?.("input, textarea, select, dialog"))return;let t=wt.value;if((n.ctrlKey||n.metaKey)&&t){let s=n.key.toLowerCase();if(s==="z"&&!n.shiftKey&&t.undo)Dn.undo();else if(s==="z"&&n.shiftKey||s==="y")t.redo&&Dn.redo();else if(s==="s"&&!t.saved)Dn.save();else if(s!=="s")return;n.preventDefault();return}if(n.ctrlKey||n.metaKey||n.altKey)return;let i=Object.keys(cu);n.key==="Escape"?(Pi.value="select",Dn.noMeasure(),Vt.value=null,Ii.value=new Set):n.key==="r"?Dn.home():n.key==="f"?Dn.fit():n.key==="p"?Dn.project():n.key==="m"?(Dn.noMeasure(),Pi.value="measure"):n.key==="?"?Li.value={type:"keys"}:/^[1-5]$/.test(n.key)&&Dn.look(i[Number(n.key)-1])});window.addEventListener("hashchange",()=>sf(location.hash,{camera:n=>pe?.eye.restore(n)}));function LI(){return{get ready(){return!!(pe&&Ue.value)},get counts(){return{pending:(Ue.value.pending??[]).length,points:pe.clouds.shownPoints,total:pe.clouds.total,loading:pe.clouds.loading,frames:pe.frames,clouds:pe.clouds.clouds.filter(n=>n.state==="open").length,failed:pe.clouds.clouds.filter(n=>n.state==="failed").length,ellipsoids:pe.network.ellipsoidCount,rays:pe.network.rayCount,moves:pe.network.moveCount,displacements:pe.network.epochCount,rows:fa.value.length,marks:pe.marks.length,labels:pe.placed?.length??0,first:pe.clouds.firstAt,held:pe.clouds.held}},get summary(){return JSON.parse(JSON.stringify(vl.value))},get session(){return JSON.parse(JSON.stringify(wt.value))},get selection(){let n=Vt.value;return n?JSON.parse(JSON.stringify({...n,item:void 0})):null},get measured(){return JSON.parse(JSON.stringify(Cs.value))},get slice(){return JSON.parse(JSON.stringify(Jn.value))},get handles(){return pe.handles()},get measuredOnScreen(){return pe.measured?.map(n=>pe.onScreen(n))??null},get points(){return yn.value.map(n=>({name:n.name,role:n.role,xyz:n.xyz,covariance:n.covariance,moved:n.moved}))},get rowsShown(){let n=Lt.value;return[...fa.value].map(e=>({id:n.id[e],component:n.component[e],w:n.w[e],residual:n.residual[e],state:n.state[e],words:ms(n,e)}))},get stale(){return Ks.value},get trip(){return ng.value},share:()=>pe.drawnShare(),pick:(n,e)=>pe.clouds.pick(n,e,pe.eye.width,pe.eye.height),onScreen:n=>pe.onScreen(pe.toDrawing(n)),colourOf:()=>({by:Kn.value,range:sa.value}),camera:()=>pe.eye.state(),look:n=>pe.look(n),view:n=>pe.eye.between(pe.toDrawing(n.eye),pe.toDrawing(n.at))}}async function DI(){Cy(a=>pl.value=a),window.matchMedia?.("(prefers-color-scheme: dark)").matches&&(Fi.value="dark"),window.innerWidth<800&&(Ir.value=!1);let e=document.getElementById("app");try{if(await tg(),Ue.value?.schema!==1)throw new Error(`scene.json is of version ${Ue.value?.schema}; this page reads version 1`)}catch(a){e.textContent=`The scene cannot be read: ${a?.message??a}`;return}document.title=`${Ue.value.title} · Tribrach`,await so().catch(()=>null);let t=wt.value;t?.adjusted&&fl(t.adjusted),t?.tested&&(ro.value=t.tested),Ks.value=!1,e.textContent="",k0(D`<${wI} />`,e);let i=sessionStorage.getItem(o0);i&&cs(i,"error"),sessionStorage.removeItem(o0);let s=await ls("api/views").then(a=>(ea.value=a??{},!0)).catch(()=>nu.value=!1),r={adjusted:a=>{fl(a),wt.value&&a.revision>wt.value.revision&&so()},tested:a=>{oi.value&&a.revision<oi.value.revision||ys(()=>{ro.value=a,Ks.value=!1})},defect:a=>Js.value=a.sentences??a,progress:a=>Cr.value=a,failed:a=>{if(Cr.value=null,a.reload){sessionStorage.setItem(o0,a.sentence),location.reload();return}so(),cs(a.sentence??"It failed.","error")},ran:()=>location.reload(),clouds:()=>iM()};if(!s)return;let o=Iy(r,a=>{pl.value=a,a&&(pe?.clouds.again(),NI()),a&&((Ue.value.pending??[]).length||!Ue.value.clouds.length)&&iM()});o.addEventListener("stopped",()=>{o.close(),Qo.value=!0})}async function NI(){let n=wt.value;if(!n)return;await so().catch(()=>null);let e=wt.value;n.running&&!e.running&&location.reload(),e.adjusted&&e.revision>n.revision&&fl(e.adjusted),e.tested?.revision===e.revision&&ys(()=>{ro.value=e.tested,Ks.value=!1})}var o0="tribrach said";async function iM(){let n=await ls("scene.json");Ue.value={...Ue.value,clouds:n.clouds,pending:n.pending},pe?.clouds.add(n.clouds),sM(),(n.pending??[]).length||(Cr.value=null)}DI();
